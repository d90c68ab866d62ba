#pragma once

#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <string>
#include <utility>

#include "vcharge_core/base/error.h"

namespace vcharge {

/// A large text file, written through printf formats. `name` is what errors call the file.
class TextWriter {
 public:
  TextWriter(const std::string& path, std::string name)
      : name_(std::move(name)), file_(path, std::ios::binary) {}

  __attribute__((format(printf, 2, 3))) void print(const char* format, ...) {
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    const int length = std::vsnprintf(text, sizeof(text), format, arguments);
    va_end(arguments);
    check(length >= 0 && static_cast<size_t>(length) < sizeof(text), "TextWriter: a line is too long");
    file_.write(text, length);
  }
  void write(const std::string& text) { file_ << text; }

  /// InputError unless all of it is on the disk.
  void close() {
    file_.close();
    if (!file_) {
      throw InputError(name_ + ": cannot be written");
    }
  }

 private:
  std::string name_;
  std::ofstream file_;
};

}  // namespace vcharge
