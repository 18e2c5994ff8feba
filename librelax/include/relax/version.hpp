#pragma once

namespace relax {

/// Version and source revision of this library, which are those of weave, e.g. "0.1.0 (abc1234)".
const char* version();

}  // namespace relax
