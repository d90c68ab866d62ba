#pragma once

#include <functional>
#include <string>

namespace vcharge {

/// Reads a whole file. Throws InputError "<path>: <reason>" when it cannot be read.
std::string readTextFile(const std::string& path);

/// Throws InputError naming `path` unless a file can be written there: its folder exists or can be created
/// and accepts new files, and `path` is not a folder. Leaves no file behind. Tools call it before long work.
void requireWritable(const std::string& path);
/// The same for a folder of results, which may exist.
void requireWritableFolder(const std::string& path);

/// Calls `write` with a temporary path beside `path` (same extension) and moves the result over `path` after
/// it returned; an older file stays unchanged when `write` throws. Creates missing folders. InputError when
/// the folder cannot be written.
void writeFileAtomically(const std::string& path,
                         const std::function<void(const std::string& temporary)>& write);
void writeTextFileAtomically(const std::string& path, const std::string& text);

/// Replaces a folder of results in one step: write into path(), then call commit(). Before that, an older
/// folder stays under the final name; without commit() the new folder is removed.
class FolderTransaction {
 public:
  /// InputError when the folder that will hold `path` cannot be written, or `path` is a file or the current
  /// folder.
  explicit FolderTransaction(const std::string& path);
  ~FolderTransaction();
  FolderTransaction(const FolderTransaction&) = delete;
  FolderTransaction& operator=(const FolderTransaction&) = delete;

  const std::string& path() const { return temporary_; }
  /// Moves the new folder to its final name and removes the older one.
  void commit();

 private:
  std::string final_, temporary_;
};

/// Creates a folder and its parents; an empty path is the current folder. InputError when that fails.
void createFolder(const std::string& path);
/// Removes a folder. It is renamed first, so that a process killed meanwhile leaves no half-removed folder
/// under its name; the remains of an earlier interrupted removal are removed too. Ignores errors.
void removeFolder(const std::string& path);

}  // namespace vcharge
