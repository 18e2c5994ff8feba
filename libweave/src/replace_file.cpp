#include "replace_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

namespace weave {

namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const char* what) {
  throw std::runtime_error(file.string() + ": cannot " + what + ": " + std::generic_category().message(errno));
}

void sync_to_disk(const std::filesystem::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
  if (descriptor < 0) fail(path, "open");
  const bool done = ::fsync(descriptor) == 0;
  const int error = errno;
  ::close(descriptor);
  errno = error;
  if (!done) fail(path, "flush to disk");
}

}  // namespace

std::filesystem::path part_of(const std::filesystem::path& file) {
  std::filesystem::path part = file;
  part += ".part";
  return part;
}

void replace_by_part(const std::filesystem::path& file) {
  sync_to_disk(part_of(file), O_RDONLY);
  if (::rename(part_of(file).c_str(), file.c_str()) != 0) fail(file, "put the new version in place");
  // The new name is safe only when its folder, too, is on disk.
  sync_to_disk(file.has_parent_path() ? file.parent_path() : ".", O_RDONLY | O_DIRECTORY);
}

}  // namespace weave
