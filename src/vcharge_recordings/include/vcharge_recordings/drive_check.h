#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/recorded_drive.h"

namespace vcharge {

enum class CheckGrade { kPass, kWarn, kFail };

/// The grade as text: "PASS", "WARN" or "FAIL".
const char* toString(CheckGrade grade);

/// Result of one check of a recorded drive.
struct CheckFinding {
  std::string subject;  ///< for example "sync" or "front: exposure"
  CheckGrade grade = CheckGrade::kPass;
  std::string what;  ///< the measured value, and the likely cause of a failure
};

/// The worst grade of the findings; kPass if there are none.
CheckGrade worstGrade(const std::vector<CheckFinding>& findings);

/// Checks a recorded drive before it is processed: are the cameras and the odometry complete, synchronous and
/// well exposed, and do they agree on the motion? Turns are compared by the angle about the common axis of
/// each camera's rotations, so the rig needs no extrinsics; where it has them, the images' motion is compared
/// with them, too. Deterministic. Stores times, odometry and a few numbers per pair of images. Not thread
/// safe.
class DriveChecker : public RecordedDriveConsumer {
 public:
  explicit DriveChecker(std::shared_ptr<const CameraRig> rig);
  ~DriveChecker() override;

  void addImage(size_t camera_index, Timestamp stamp, Timestamp recorded, const Image& image) override;
  void addOdometry(Timestamp recorded, const VehicleOdometry& odometry) override;
  void addBroken(const std::string& topic, const std::string& why) override;

  /// The findings of all checks, in a fixed order.
  std::vector<CheckFinding> findings() const;

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace vcharge
