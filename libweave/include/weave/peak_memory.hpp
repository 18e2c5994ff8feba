#pragma once

namespace weave {

/// Largest memory that this process has held so far [bytes].
double peak_memory_bytes();

}  // namespace weave
