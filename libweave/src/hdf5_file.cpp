#include "hdf5_file.hpp"

#include <hdf5.h>

#include <algorithm>
#include <stdexcept>
#include <system_error>
#include <type_traits>
#include <utility>

#include "replace_file.hpp"

namespace weave {

namespace {

/// Owns an HDF5 identifier of any kind.
class Id {
 public:
  explicit Id(hid_t id) : id_(id) {}
  Id(const Id&) = delete;
  Id& operator=(const Id&) = delete;
  ~Id() {
    if (id_ >= 0) H5Idec_ref(id_);
  }
  [[nodiscard]] hid_t get() const { return id_; }
  [[nodiscard]] bool valid() const { return id_ >= 0; }

 private:
  hid_t id_;
};

/// Keeps HDF5 from printing its errors while in scope.
class QuietErrors {
 public:
  QuietErrors() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;
  ~QuietErrors() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

/// To be called before all else of HDF5. At exit it would close a file again that a full disk has kept it from closing, and crash; here
/// each file is closed by its owner.
void leave_exit_alone() {
  [[maybe_unused]] static const herr_t once = H5dont_atexit();
}

/// Innermost entry of HDF5's error stack: the cause.
std::string cause_of_error() {
  std::string cause;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned depth, const H5E_error2_t* error, void* text) -> herr_t {
        if (depth == 0 && error->desc != nullptr) *static_cast<std::string*>(text) = error->desc;
        return 0;
      },
      &cause);
  H5Eclear2(H5E_DEFAULT);
  return cause;
}

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& path, const std::string& what,
                       const std::string& cause = cause_of_error()) {
  throw std::runtime_error(file.string() + ":" + (path.empty() ? "" : " " + path + ":") + " " + what +
                           (cause.empty() ? "" : " (HDF5: " + cause + ")"));
}

template <class T>
hid_t native_type() {
  if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<T, std::int32_t>) return H5T_NATIVE_INT32;
  if constexpr (std::is_same_v<T, std::int64_t>) return H5T_NATIVE_INT64;
  if constexpr (std::is_same_v<T, std::uint8_t>) return H5T_NATIVE_UINT8;
  if constexpr (std::is_same_v<T, std::uint32_t>) return H5T_NATIVE_UINT32;
}

template <class T>
const char* name_of_type() {
  if constexpr (std::is_same_v<T, double>) return "double";
  if constexpr (std::is_same_v<T, std::int32_t>) return "int32";
  if constexpr (std::is_same_v<T, std::int64_t>) return "int64";
  if constexpr (std::is_same_v<T, std::uint8_t>) return "uint8";
  if constexpr (std::is_same_v<T, std::uint32_t>) return "uint32";
}

/// Does the stored type hold T's values as they are, byte order aside?
template <class T>
bool holds(hid_t stored) {
  const bool is_float = std::is_floating_point_v<T>;
  if (H5Tget_class(stored) != (is_float ? H5T_FLOAT : H5T_INTEGER) || H5Tget_size(stored) != sizeof(T)) return false;
  return is_float || H5Tget_sign(stored) == (std::is_signed_v<T> ? H5T_SGN_2 : H5T_SGN_NONE);
}

/// Long arrays are stored in compressed chunks: indices and the like shrink to little.
void set_layout(hid_t layout, hsize_t rows, hsize_t columns, int rank) {
  constexpr hsize_t chunk_values = 32768;
  if (rows * columns <= chunk_values) return;
  const hsize_t chunk[2] = {std::clamp<hsize_t>(chunk_values / columns, 1, rows), columns};
  H5Pset_chunk(layout, rank, chunk);
  H5Pset_shuffle(layout);
  H5Pset_deflate(layout, 1);
}

template <class T>
void write_array(hid_t file_id, const std::filesystem::path& file, const std::string& path, std::span<const T> values, std::size_t columns,
                 int rank) {
  const QuietErrors quiet;
  const hsize_t shape[2] = {values.size() / columns, columns};
  const Id space(H5Screate_simple(rank, shape, nullptr));
  const Id links(H5Pcreate(H5P_LINK_CREATE));
  H5Pset_create_intermediate_group(links.get(), 1);
  const Id layout(H5Pcreate(H5P_DATASET_CREATE));
  set_layout(layout.get(), shape[0], shape[1], rank);
  const Id set(H5Dcreate2(file_id, path.c_str(), native_type<T>(), space.get(), links.get(), layout.get(), H5P_DEFAULT));
  if (!set.valid()) fail(file, path, "cannot make the data set");
  if (!values.empty() && H5Dwrite(set.get(), native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    fail(file, path, "cannot write the data set");
}

}  // namespace

Hdf5File::Hdf5File(std::filesystem::path file, std::int64_t id, bool writing) : file_(std::move(file)), id_(id), writing_(writing) {}

Hdf5File::Hdf5File(Hdf5File&& other) noexcept
    : file_(std::move(other.file_)), id_(std::exchange(other.id_, -1)), writing_(std::exchange(other.writing_, false)) {}

Hdf5File::~Hdf5File() {
  if (id_ >= 0) {
    const QuietErrors quiet;
    H5Fclose(id_);
  }
  if (writing_) {
    std::error_code ignored;
    std::filesystem::remove(part_of(file_), ignored);
  }
}

Hdf5File Hdf5File::create(const std::filesystem::path& file) {
  leave_exit_alone();
  const QuietErrors quiet;
  const hid_t id = H5Fcreate(part_of(file).c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  if (id < 0) fail(file, "", "cannot create the file");
  return {file, id, true};
}

Hdf5File Hdf5File::open(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) throw std::runtime_error(file.string() + ": no such file");
  leave_exit_alone();
  const QuietErrors quiet;
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (id < 0) fail(file, "", "cannot open as an HDF5 file");
  return {file, id, false};
}

void Hdf5File::commit() {
  const QuietErrors quiet;
  const bool flushed = H5Fflush(id_, H5F_SCOPE_GLOBAL) >= 0;
  const std::string cause = flushed ? "" : cause_of_error();  // before the next call clears it
  const bool closed = H5Fclose(std::exchange(id_, -1)) >= 0;
  if (!flushed) fail(file_, "", "cannot finish the file", cause);
  if (!closed) fail(file_, "", "cannot finish the file");
  replace_by_part(file_);
  writing_ = false;
}

void Hdf5File::write_group(const std::string& path) {
  const QuietErrors quiet;
  const Id links(H5Pcreate(H5P_LINK_CREATE));
  H5Pset_create_intermediate_group(links.get(), 1);
  const Id group(H5Gcreate2(id_, path.c_str(), links.get(), H5P_DEFAULT, H5P_DEFAULT));
  if (!group.valid()) fail(file_, path, "cannot make the group");
}

template <class T>
void Hdf5File::write(const std::string& path, std::span<const T> values) {
  write_array(id_, file_, path, values, 1, 1);
}

template <class T>
void Hdf5File::write_rows(const std::string& path, std::span<const T> values, std::size_t columns) {
  write_array(id_, file_, path, values, columns, 2);
}

void Hdf5File::write_text(const std::string& path, const std::string& text) {
  const QuietErrors quiet;
  const Id space(H5Screate(H5S_SCALAR));
  const Id type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), H5T_VARIABLE);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  const Id links(H5Pcreate(H5P_LINK_CREATE));
  H5Pset_create_intermediate_group(links.get(), 1);
  const Id set(H5Dcreate2(id_, path.c_str(), type.get(), space.get(), links.get(), H5P_DEFAULT, H5P_DEFAULT));
  if (!set.valid()) fail(file_, path, "cannot make the data set");
  const char* pointer = text.c_str();
  if (H5Dwrite(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &pointer) < 0) fail(file_, path, "cannot write the text");
}

void Hdf5File::write_attribute(const std::string& path, const std::string& name, const std::string& text) {
  const QuietErrors quiet;
  const Id space(H5Screate(H5S_SCALAR));
  const Id type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), text.size());
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  const Id attribute(H5Acreate_by_name(id_, path.c_str(), name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  if (!attribute.valid() || H5Awrite(attribute.get(), type.get(), text.data()) < 0)
    fail(file_, path, "cannot write the attribute \"" + name + "\"");
}

void Hdf5File::write_attribute(const std::string& path, const std::string& name, std::span<const std::int64_t> values) {
  const QuietErrors quiet;
  const hsize_t size = values.size();
  const Id space(H5Screate_simple(1, &size, nullptr));
  const Id attribute(
      H5Acreate_by_name(id_, path.c_str(), name.c_str(), H5T_NATIVE_INT64, space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  if (!attribute.valid() || H5Awrite(attribute.get(), H5T_NATIVE_INT64, values.data()) < 0)
    fail(file_, path, "cannot write the attribute \"" + name + "\"");
}

bool Hdf5File::has(const std::string& path) const {
  // H5Lexists fails when a group on the way is missing, so the path is followed link by link.
  const QuietErrors quiet;
  for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    if (H5Lexists(id_, path.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
    if (end == std::string::npos) return true;
  }
}

bool Hdf5File::has_attribute(const std::string& path, const std::string& name) const {
  const QuietErrors quiet;
  return H5Aexists_by_name(id_, path.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

template <class T>
Hdf5Array<T> Hdf5File::read_rows(const std::string& path) const {
  const QuietErrors quiet;
  const Id set(H5Dopen2(id_, path.c_str(), H5P_DEFAULT));
  if (!set.valid()) fail(file_, path, "no such data set");
  const Id type(H5Dget_type(set.get()));
  if (!holds<T>(type.get())) fail(file_, path, std::string("is not of type ") + name_of_type<T>());
  const Id space(H5Dget_space(set.get()));
  const int rank = H5Sget_simple_extent_ndims(space.get());
  if (rank != 1 && rank != 2) fail(file_, path, "has neither one nor two dimensions");
  hsize_t shape[2] = {0, 1};
  H5Sget_simple_extent_dims(space.get(), shape, nullptr);
  Hdf5Array<T> array{std::vector<T>(shape[0] * shape[1]), shape[0], shape[1]};
  if (!array.values.empty() && H5Dread(set.get(), native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, array.values.data()) < 0)
    fail(file_, path, "cannot read the data set");
  return array;
}

template <class T>
std::vector<T> Hdf5File::read(const std::string& path) const {
  Hdf5Array<T> array = read_rows<T>(path);
  if (array.columns != 1) fail(file_, path, "has " + std::to_string(array.columns) + " columns where one is expected");
  return std::move(array.values);
}

std::string Hdf5File::read_text(const std::string& path) const {
  const QuietErrors quiet;
  const Id set(H5Dopen2(id_, path.c_str(), H5P_DEFAULT));
  if (!set.valid()) fail(file_, path, "no such data set");
  const Id type(H5Dget_type(set.get()));
  if (H5Tget_class(type.get()) != H5T_STRING || H5Tis_variable_str(type.get()) <= 0) fail(file_, path, "is not a text");
  const Id space(H5Dget_space(set.get()));
  if (H5Sget_simple_extent_npoints(space.get()) != 1) fail(file_, path, "is not one text");
  char* pointer = nullptr;
  if (H5Dread(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &pointer) < 0) fail(file_, path, "cannot read the text");
  std::string text = pointer != nullptr ? pointer : "";
  H5free_memory(pointer);
  return text;
}

std::string Hdf5File::read_text_attribute(const std::string& path, const std::string& name) const {
  const QuietErrors quiet;
  const Id attribute(H5Aopen_by_name(id_, path.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT));
  if (!attribute.valid()) fail(file_, path, "has no attribute \"" + name + "\"");
  const Id type(H5Aget_type(attribute.get()));
  if (H5Tget_class(type.get()) != H5T_STRING || H5Tis_variable_str(type.get()) > 0)
    fail(file_, path, "attribute \"" + name + "\" is not a text of fixed length");
  std::string text(H5Tget_size(type.get()), '\0');
  if (H5Aread(attribute.get(), type.get(), text.data()) < 0) fail(file_, path, "cannot read the attribute \"" + name + "\"");
  text.resize(std::min(text.find('\0'), text.size()));
  return text;
}

#define WEAVE_HDF5_TYPE(T)                                                                    \
  template void Hdf5File::write<T>(const std::string&, std::span<const T>);                   \
  template void Hdf5File::write_rows<T>(const std::string&, std::span<const T>, std::size_t); \
  template std::vector<T> Hdf5File::read<T>(const std::string&) const;                        \
  template Hdf5Array<T> Hdf5File::read_rows<T>(const std::string&) const;

WEAVE_HDF5_TYPE(double)
WEAVE_HDF5_TYPE(std::int32_t)
WEAVE_HDF5_TYPE(std::int64_t)
WEAVE_HDF5_TYPE(std::uint8_t)
WEAVE_HDF5_TYPE(std::uint32_t)
#undef WEAVE_HDF5_TYPE

}  // namespace weave
