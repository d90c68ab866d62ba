#include "vcharge_core/files/file_io.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

/// The folder that holds `path`: "." for a name without a folder.
fs::path parentOf(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

/// `path` in its shortest form without a slash at its end, so that a name can be appended to it.
std::string pathWithoutSlash(const std::string& path) {
  std::string folder = fs::path(path).lexically_normal().string();
  while (folder.size() > 1 && folder.back() == '/') {
    folder.pop_back();
  }
  return folder;
}

/// Creates and removes a file in `folder`, or in its nearest existing parent: permissions alone do not show
/// whether the file system accepts new files. Errors name `path`.
void requireNewFiles(fs::path folder, const std::string& path) {
  std::error_code error;
  while (!fs::exists(folder, error)) {
    folder = parentOf(folder);
  }
  if (!fs::is_directory(folder)) {
    throw InputError(path + ": cannot be written: " + folder.string() + " is not a folder");
  }
  std::string probe = (folder / ".writable.XXXXXX").string();
  const int descriptor = mkstemp(probe.data());
  if (descriptor < 0) {
    throw InputError(path + ": cannot be written: the folder " + folder.string() +
                     " accepts no new file: " + std::strerror(errno));
  }
  close(descriptor);
  unlink(probe.c_str());
}

}  // namespace

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

void requireWritable(const std::string& path) {
  if (fs::path(path).filename().empty() || fs::is_directory(path)) {
    throw InputError(path + ": expected the name of a file, is a folder");
  }
  requireNewFiles(parentOf(path), path);
}

void requireWritableFolder(const std::string& path) {
  const fs::path folder = pathWithoutSlash(path);
  if (fs::exists(folder) && !fs::is_directory(folder)) {
    throw InputError(path + ": expected a folder, is a file");
  }
  requireNewFiles(folder, path);
}

void writeFileAtomically(const std::string& path,
                         const std::function<void(const std::string& temporary)>& write) {
  const fs::path target(path);
  const fs::path folder = parentOf(target);
  std::error_code folder_error;
  fs::create_directories(folder, folder_error);
  if (folder_error) {
    throw InputError(path + ": the folder " + folder.string() +
                     " cannot be created: " + folder_error.message());
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

FolderTransaction::FolderTransaction(const std::string& path) : final_(pathWithoutSlash(path)) {
  if (fs::exists(final_) && !fs::is_directory(final_)) {
    throw InputError(final_ + ": expected a folder, is a file");
  }
  if (fs::exists(final_) && fs::equivalent(final_, fs::current_path())) {
    throw InputError(final_ + ": the current folder cannot be replaced; name a folder in it");
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
  if (path.empty()) {
    return;  // the folder of a file name without a folder is the current one
  }
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
