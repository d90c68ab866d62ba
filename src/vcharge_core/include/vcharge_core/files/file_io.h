#pragma once

#include <functional>
#include <string>

namespace vcharge {

/// Whole text of a file. InputError "<path>: <reason>" when it cannot be read.
std::string readTextFile(const std::string& path);

/// Calls `write` with a temporary path beside `path` (same extension) and moves the result over `path` once
/// it returned: what was there stays as it is when `write` throws. InputError when the folder cannot be
/// written.
void writeFileAtomically(const std::string& path,
                         const std::function<void(const std::string& temporary)>& write);
void writeTextFileAtomically(const std::string& path, const std::string& text);

/// A folder of results that appears as a whole or not at all: write into path(), then commit(). Until then
/// whatever stands under the final name stays; without commit() what was written is removed.
class FolderTransaction {
 public:
  /// InputError when the folder beside `path` cannot be written, or `path` is a file.
  explicit FolderTransaction(std::string path);
  ~FolderTransaction();
  FolderTransaction(const FolderTransaction&) = delete;
  FolderTransaction& operator=(const FolderTransaction&) = delete;

  const std::string& path() const { return temporary_; }
  /// Moves the folder to its final name, in place of what stands there.
  void commit();

 private:
  std::string final_, temporary_;
};

/// Creates a folder and its parents. InputError when that fails.
void createFolder(const std::string& path);
/// Removes a folder that goes on being used should it stay: it is gone under its name before its first file
/// is, so that being killed leaves no part of it there, and what an earlier kill left is removed too. Errors
/// are ignored.
void removeFolder(const std::string& path);

}  // namespace vcharge
