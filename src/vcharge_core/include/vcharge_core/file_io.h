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

/// Creates a folder and its parents. InputError when that fails.
void createFolder(const std::string& path);

}  // namespace vcharge
