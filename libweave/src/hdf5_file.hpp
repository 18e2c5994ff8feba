#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace weave {

/// A data set's values, row by row: (rows x columns); a one-dimensional data set has one column.
template <class T>
struct Hdf5Array {
  std::vector<T> values;
  std::size_t rows = 0;
  std::size_t columns = 1;
};

/// An HDF5 file, either being written or open for reading. Data sets are named by absolute path ("/history/time_s"); the groups on the
/// way are made as needed. T is double, std::int32_t, std::int64_t, std::uint8_t or std::uint32_t. Every failure throws
/// std::runtime_error naming file, data set and cause.
class Hdf5File {
 public:
  /// Starts a new file aside ("<file>.part"); `file` itself is untouched until commit(), and for good if that is never called.
  static Hdf5File create(const std::filesystem::path& file);

  /// Opens for reading.
  static Hdf5File open(const std::filesystem::path& file);

  Hdf5File(Hdf5File&& other) noexcept;
  Hdf5File& operator=(Hdf5File&&) = delete;
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;
  ~Hdf5File();

  /// Closes the new file, waits until it is on disk and puts it in the place of the old one.
  void commit();

  void write_group(const std::string& path);

  template <class T>
  void write(const std::string& path, std::span<const T> values);
  template <class T>
  void write(const std::string& path, const std::vector<T>& values) {
    write(path, std::span<const T>(values));
  }

  /// values: (values.size() / columns x columns), row by row.
  template <class T>
  void write_rows(const std::string& path, std::span<const T> values, std::size_t columns);

  /// UTF-8, of any length.
  void write_text(const std::string& path, const std::string& text);

  /// Of an existing group or data set; the text is stored with its fixed length and must not be empty.
  void write_attribute(const std::string& path, const std::string& name, const std::string& text);
  void write_attribute(const std::string& path, const std::string& name, std::span<const std::int64_t> values);

  /// Is there a group or data set of this path?
  [[nodiscard]] bool has(const std::string& path) const;
  [[nodiscard]] bool has_attribute(const std::string& path, const std::string& name) const;

  /// The data set must hold numbers of type T and have one dimension.
  template <class T>
  [[nodiscard]] std::vector<T> read(const std::string& path) const;

  /// Same with one or two dimensions.
  template <class T>
  [[nodiscard]] Hdf5Array<T> read_rows(const std::string& path) const;

  [[nodiscard]] std::string read_text(const std::string& path) const;
  [[nodiscard]] std::string read_text_attribute(const std::string& path, const std::string& name) const;

 private:
  Hdf5File(std::filesystem::path file, std::int64_t id, bool writing);

  std::filesystem::path file_;  ///< final name
  std::int64_t id_ = -1;        ///< HDF5 identifier of the open file, negative when closed
  bool writing_ = false;
};

}  // namespace weave
