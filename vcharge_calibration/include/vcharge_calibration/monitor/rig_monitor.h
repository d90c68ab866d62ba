#pragma once

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/monitor/rig_change_detector.h"
#include "vcharge_calibration/monitor/rig_deviation.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"

namespace vcharge {

class CameraSight;
class LensDirt;

struct RigMonitorOptions {
  VCHARGE_BEGIN_OPTIONS(RigMonitorOptions);
  VCHARGE_OPTION(double, false_alarms_per_km, 1e-3, positive(), "Accepted where nothing changes.");
  VCHARGE_END_OPTIONS();
};

/// A camera whose sight is less sees too little to count.
inline constexpr double kMinSight = 0.3;

/// What is known about the car at the end of a part of the drive.
struct MonitoredPart {
  Timestamp end;
  double begin_m = 0.0, end_m = 0.0;  ///< driven since the start
  Eigen::VectorXd deviation, sigmas;  ///< from the rig, in the order of RigDeviation
  /// What each camera sees relative to what it usually sees, and to the others: 1 as usual, 0 nothing.
  std::vector<double> sight;
  /// Cameras that saw too little all the way for some time: their lenses are dirty, covered or blinded.
  std::vector<bool> sees_little;
  /// Part of the ground that each camera could see which spots on its lens hide, and cameras for which that
  /// has been much for some time.
  std::vector<double> dirt;
  std::vector<bool> is_dirty;
  std::optional<RigChange> change;  ///< that this part made certain
};

/// A rig that replaced the one before, since cameras had moved.
struct RigAdoption {
  double at_m = 0.0;            ///< driven until then
  std::vector<size_t> cameras;  ///< whose extrinsics differ
};

/// Watches a rig during ordinary driving: cuts the drive into parts, estimates from each how the car deviates
/// from its rig, and finds changes. A part is adjusted in a thread of its own while the next one is driven;
/// what comes out does not depend on how long that takes. Parts in which a camera sees little say nothing
/// about that camera. Memory: two parts' images, and a few numbers of each part before.
class RigMonitor : public DriveConsumer {
 public:
  using PartCallback = std::function<void(const MonitoredPart&)>;

  /// InputError unless all cameras have extrinsics. `on_part` may be empty; it is called by the thread
  /// that adjusts.
  RigMonitor(std::shared_ptr<const CameraRig> rig, const RigCalibratorOptions& calibration,
             const RigMonitorOptions& options, PartCallback on_part);
  ~RigMonitor() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Ends the last part, and waits for it. Another drive may follow.
  void flush();
  /// Goes on with a repaired rig, after flush(): from now on deviations are from this one, and changes of the
  /// cameras that it moved are accounted for. InputError unless it has the same cameras.
  void adopt(std::shared_ptr<const CameraRig> rig);

  const CameraRig& rig() const { return *rig_; }
  /// Distance of all parts.
  double travelled_m() const { return parts_.empty() ? 0.0 : parts_.back().end_m; }
  // To be read within `on_part`, or after flush().
  const std::vector<MonitoredPart>& parts() const { return parts_; }
  std::vector<RigChange> changes() const;
  /// Those that the rig, as last adopted, does not account for.
  std::vector<RigChange> openChanges() const;
  const std::vector<RigAdoption>& adoptions() const { return adoptions_; }
  const PitchResponse& pitchResponse() const { return pitch_; }
  /// Covariance of the present deviation, in the order of RigDeviation.
  Eigen::MatrixXd covariance() const { return detector_.covariance(); }

 private:
  struct Drive;

  void startPart();
  void endPartIfDue();
  void endPart();
  void adjustEndedPart();
  void waitForEndedPart();

  std::shared_ptr<const CameraRig> rig_;
  const RigCalibratorOptions calibration_;
  const RigMonitorOptions options_;
  const PartCallback on_part_;
  RigChangeDetector detector_;
  std::unique_ptr<CameraSight> sight_;
  std::vector<LensDirt> lenses_;
  std::unique_ptr<Drive> drive_, ended_;
  std::vector<MonitoredPart> parts_;
  std::vector<RigAdoption> adoptions_;
  PitchResponse pitch_;
  std::vector<double> dim_m_;     ///< by camera, driven since it sees too little
  std::vector<int> dirty_parts_;  ///< by camera, since its lens is dirty
  std::future<void> adjustment_;  ///< of ended_; destroyed first, since it uses the others
};

}  // namespace vcharge
