#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Little-endian bytes into a file and its hash. Checks nothing: look at the stream in the end.
class ArchiveWriter {
 public:
  static constexpr bool kReads = false;
  explicit ArchiveWriter(std::ofstream* file) : file_(file) {}
  ~ArchiveWriter() { flush(); }
  ArchiveWriter(const ArchiveWriter&) = delete;
  ArchiveWriter& operator=(const ArchiveWriter&) = delete;

  void bytes(void* data, size_t size) {
    buffer_.append(static_cast<const char*>(data), size);
    if (buffer_.size() >= kBuffer) {
      flush();
    }
  }
  void flush() {
    hasher_.addBytes(buffer_.data(), buffer_.size());
    file_->write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    buffer_.clear();
  }
  std::string hash() const { return hasher_.hex(); }

 private:
  static constexpr size_t kBuffer = 1 << 20;
  std::ofstream* file_;
  std::string buffer_;
  ContentHasher hasher_;
};

/// The same from memory. InputError "damaged" where it ends too early.
class ArchiveReader {
 public:
  static constexpr bool kReads = true;
  ArchiveReader(const char* begin, const char* end) : position_(begin), end_(end) {}

  void bytes(void* data, size_t size) {
    require(size);
    if (size > 0) {
      std::memcpy(data, position_, size);
    }
    position_ += size;
  }
  /// That so many bytes are left.
  void require(size_t size) const {
    if (size > static_cast<size_t>(end_ - position_)) {
      throw InputError("damaged");
    }
  }
  bool isAtEnd() const { return position_ == end_; }

 private:
  const char* position_;
  const char* end_;
};

template <class Archive, class T>
std::enable_if_t<std::is_arithmetic_v<T> || std::is_enum_v<T>> transfer(Archive& archive, T& value) {
  archive.bytes(&value, sizeof(value));
}

template <class Archive>
size_t transferSize(Archive& archive, size_t size, size_t min_bytes_each) {
  auto stored = static_cast<uint64_t>(size);
  transfer(archive, stored);
  if constexpr (Archive::kReads) {
    if (stored > (uint64_t{1} << 40)) {
      throw InputError("damaged");
    }
    archive.require(stored * min_bytes_each);
  }
  return static_cast<size_t>(stored);
}

template <class Archive>
void transfer(Archive& archive, std::string& text) {
  text.resize(transferSize(archive, text.size(), 1));
  archive.bytes(text.data(), text.size());
}

template <class Archive>
void transfer(Archive& archive, Timestamp& stamp) {
  int64_t nanoseconds = stamp.nanoseconds();
  transfer(archive, nanoseconds);
  stamp = Timestamp::fromNanoseconds(nanoseconds);
}

template <class Archive, class Scalar, int kRows, int kColumns>
void transfer(Archive& archive, Eigen::Matrix<Scalar, kRows, kColumns>& matrix) {
  static_assert(kRows != Eigen::Dynamic);
  if constexpr (kColumns == Eigen::Dynamic) {
    matrix.resize(kRows, static_cast<Eigen::Index>(transferSize(archive, static_cast<size_t>(matrix.cols()),
                                                                kRows * sizeof(Scalar))));
  }
  archive.bytes(matrix.data(), static_cast<size_t>(matrix.size()) * sizeof(Scalar));
}

template <class Archive>
void transfer(Archive& archive, RigidTransform& transform) {
  Eigen::Vector4d rotation = transform.rotation().coeffs();
  Eigen::Vector3d translation = transform.translation();
  transfer(archive, rotation);
  transfer(archive, translation);
  if constexpr (Archive::kReads) {
    transform = RigidTransform::fromUnit(Eigen::Quaterniond(rotation), translation);
  }
}

template <class Archive>
void transfer(Archive& archive, cv::Mat& matrix) {
  int32_t rows = matrix.rows, columns = matrix.cols, type = matrix.type();
  transfer(archive, rows);
  transfer(archive, columns);
  transfer(archive, type);
  if constexpr (Archive::kReads) {
    if (rows < 0 || columns < 0 || (type != CV_8UC1 && type != CV_32FC1)) {
      throw InputError("damaged");
    }
    archive.require(static_cast<size_t>(rows) * columns * CV_ELEM_SIZE(type));
    matrix.create(rows, columns, type);
  }
  for (int row = 0; row < rows; ++row) {
    archive.bytes(matrix.ptr(row), static_cast<size_t>(columns) * matrix.elemSize());
  }
}

template <class Archive, class T, size_t kSize>
void transfer(Archive& archive, std::array<T, kSize>& values) {
  for (T& value : values) {
    transfer(archive, value);
  }
}

template <class Archive, class T>
void transfer(Archive& archive, std::optional<T>& value) {
  bool has_value = value.has_value();
  transfer(archive, has_value);
  if constexpr (Archive::kReads) {
    value.reset();
    if (has_value) {
      value.emplace();
    }
  }
  if (has_value) {
    transfer(archive, *value);
  }
}

template <class Archive, class Key, class Value>
void transfer(Archive& archive, std::map<Key, Value>& values) {
  const size_t size = transferSize(archive, values.size(), 1);
  if constexpr (Archive::kReads) {
    for (size_t i = 0; i < size; ++i) {
      Key key;
      transfer(archive, key);
      transfer(archive, values[key]);
    }
  } else {
    for (auto& [key, value] : values) {
      Key copy = key;
      transfer(archive, copy);
      transfer(archive, value);
    }
  }
}

template <class Archive, class T>
void transfer(Archive& archive, std::vector<T>& values) {
  values.resize(transferSize(archive, values.size(), 1));
  for (T& value : values) {
    transfer(archive, value);
  }
}

}  // namespace vcharge
