#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace vcharge {

/// A reader of bytes from outside. Whatever the bytes are, it must either take them or throw InputError (for
/// options std::invalid_argument); take() lets these pass, and what else comes out of it is a defect.
struct FuzzTarget {
  std::string name;
  std::function<std::vector<std::string>()> seeds;  ///< bytes that the reader takes without an error
  std::function<void(const std::string& bytes)> read;
};

/// True when the bytes were taken, false when they were refused as they should be.
bool take(const FuzzTarget& target, const std::string& bytes);

/// All of them; std::out_of_range for an unknown name.
const std::vector<FuzzTarget>& fuzzTargets();
const FuzzTarget& fuzzTarget(const std::string& name);

/// Readers that know no ROS and belong to vcharge_core, _geometry and _features; recordings, messages and
/// buses; files and options of the stages.
std::vector<FuzzTarget> coreTargets();
std::vector<FuzzTarget> driveTargets();
std::vector<FuzzTarget> stageTargets();

/// A folder in memory (or wherever temporary files are) that is removed with the object.
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

/// What `write(path)` leaves in a file.
std::string bytesOf(const std::string& name, const std::function<void(const std::string& path)>& write);
/// A target of a reader that takes a path.
FuzzTarget fileTarget(const std::string& name, const std::string& file_name, std::vector<std::string> seeds,
                      std::function<void(const std::string& path)> read);

}  // namespace vcharge
