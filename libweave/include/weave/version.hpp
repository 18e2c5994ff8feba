#pragma once

namespace weave {

/// Program version and source revision, e.g. "0.1.0 (abc1234)", "0.1.0 (abc1234+dirty)" where tracked files were changed, or "0.1.0"
/// where the sources are not a git checkout.
const char* version();

}  // namespace weave
