#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/recorded_drive.h"

namespace vcharge {

enum class CheckGrade { kPass, kWarn, kFail };

/// "PASS", "WARN", "FAIL"
const char* toString(CheckGrade grade);

/// What one check of a recorded drive found.
struct CheckFinding {
  std::string subject;  ///< "sync", "front: exposure"
  CheckGrade grade = CheckGrade::kPass;
  std::string what;  ///< the figure, and for what does not pass what it may come from
};

/// The worst of them; kPass without any.
CheckGrade worstGrade(const std::vector<CheckFinding>& findings);

/// Judges a recorded drive before hours are spent on it: are the four cameras and the odometry complete, in
/// step, well exposed, and do they tell of the same motion? The rig may lack extrinsics; where it has them,
/// the images' motion is compared with them as well. Turns are compared by the angle about the axis that each
/// camera's rotations have in common, so no calibration of the mounting is needed. Deterministic. Keeps
/// times, odometry and a few figures per pair of images, no images but the last ones. Not thread safe.
class DriveChecker : public RecordedDriveConsumer {
 public:
  explicit DriveChecker(std::shared_ptr<const CameraRig> rig);
  ~DriveChecker() override;

  void addImage(size_t camera_index, Timestamp stamp, Timestamp recorded, const Image& image) override;
  void addOdometry(Timestamp recorded, const VehicleOdometry& odometry) override;
  void addBroken(const std::string& topic, const std::string& why) override;

  /// All that was checked, in a fixed order.
  std::vector<CheckFinding> findings() const;

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace vcharge
