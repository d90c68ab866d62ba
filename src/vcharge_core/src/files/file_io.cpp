#include "vcharge_core/files/file_io.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace fs = std::filesystem;

std::string readTextFile(const std::string& path) {
  if (fs::is_directory(path)) {
    throw InputError(path + ": expected a file, is a folder");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw InputError(path + ": cannot be read: " + std::strerror(errno));
  }
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void writeFileAtomically(const std::string& path,
                         const std::function<void(const std::string& temporary)>& write) {
  const fs::path target(path);
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!fs::is_directory(folder)) {
    throw InputError(path + ": the folder " + folder.string() + " does not exist");
  }
  if (access(folder.c_str(), W_OK) != 0) {
    throw InputError(path + ": the folder " + folder.string() +
                     " cannot be written: " + std::strerror(errno));
  }
  const fs::path temporary = folder / ("." + target.stem().string() + "." + std::to_string(getpid()) +
                                       ".tmp" + target.extension().string());
  try {
    write(temporary.string());
    std::error_code error;
    fs::rename(temporary, target, error);
    if (error) {
      throw InputError(path + ": cannot be written: " + error.message());
    }
  } catch (...) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw;
  }
}

void writeTextFileAtomically(const std::string& path, const std::string& text) {
  writeFileAtomically(path, [&](const std::string& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file << text;
    file.close();
    if (!file) {
      throw InputError(path + ": cannot be written: " + std::strerror(errno));
    }
  });
}

FolderTransaction::FolderTransaction(std::string path) : final_(std::move(path)) {
  while (final_.size() > 1 && final_.back() == '/') {
    final_.pop_back();  // the temporary folder stands beside, not inside
  }
  if (fs::exists(final_) && !fs::is_directory(final_)) {
    throw InputError(final_ + ": expected a folder, is a file");
  }
  const fs::path target(final_);
  temporary_ =
      (target.parent_path() / ("." + target.filename().string() + "." + std::to_string(getpid()) + ".tmp"))
          .string();
  std::error_code error;
  fs::create_directories(temporary_, error);
  if (error) {
    throw InputError(final_ + ": the folder cannot be created: " + error.message());
  }
}

FolderTransaction::~FolderTransaction() {
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
}

void FolderTransaction::commit() {
  const std::string replaced = temporary_ + ".old";
  std::error_code error;
  if (fs::exists(final_)) {
    fs::rename(final_, replaced, error);
  }
  if (!error) {
    fs::rename(temporary_, final_, error);
  }
  if (error) {
    throw InputError(final_ + ": the folder cannot be written: " + error.message());
  }
  fs::remove_all(replaced, error);
}

void createFolder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path)) {
    throw InputError(path + ": the folder cannot be created" + (error ? ": " + error.message() : ""));
  }
}

void removeFolder(const std::string& path) {
  const std::string removed = path + ".removed";
  std::error_code ignored;
  fs::remove_all(removed, ignored);
  fs::rename(path, removed, ignored);
  fs::remove_all(removed, ignored);
}

}  // namespace vcharge
