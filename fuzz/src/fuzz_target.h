#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace vcharge {

/// A reader of untrusted bytes. It must either accept any bytes or throw InputError (std::invalid_argument
/// for options), which take() ignores; any other outcome is a defect.
struct FuzzTarget {
  std::string name;
  std::function<std::vector<std::string>()> seeds;  ///< valid inputs of the reader
  std::function<void(const std::string& bytes)> read;
};

/// True if the bytes were accepted, false if they were properly rejected.
bool take(const FuzzTarget& target, const std::string& bytes);

/// All targets; throws std::out_of_range for an unknown name.
const std::vector<FuzzTarget>& fuzzTargets();
const FuzzTarget& fuzzTarget(const std::string& name);

/// Targets of readers without ROS in vcharge_core and vcharge_features; of recordings, messages and buses; of
/// files and options of the stages.
std::vector<FuzzTarget> coreTargets();
std::vector<FuzzTarget> driveTargets();
std::vector<FuzzTarget> stageTargets();

/// A folder in memory, or among the temporary files, that the destructor removes.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::string& path() const { return path_; }
  /// Writes a file; returns its path.
  std::string write(const std::string& name, const std::string& bytes) const;

 private:
  std::string path_;
};

/// Content of the file written by `write(path)`.
std::string bytesOf(const std::string& name, const std::function<void(const std::string& path)>& write);
/// A target for a reader that takes a path.
FuzzTarget fileTarget(const std::string& name, const std::string& file_name, std::vector<std::string> seeds,
                      std::function<void(const std::string& path)> read);

}  // namespace vcharge
