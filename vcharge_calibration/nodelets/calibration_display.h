#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "vcharge_calibration/live/rig_calibration_session.h"
#include "vcharge_calibration/rig/rig_calibrator_options.h"

namespace vcharge {

/// Publishes a session's status on /calibration/status, and shows its drive on /calibration/trajectory,
/// /calibration/landmarks (by camera) and /calibration/cameras, all latched, in the frame `map`. Thread safe.
class CalibrationDisplay {
 public:
  CalibrationDisplay(ros::NodeHandle* node, const RigCalibratorOptions& options);

  void tell(const RigCalibrationSession::Status& status);

  /// The drive so far, with the camera poses from hand-eye calibration.
  void showDrive(const RigCalibrationSession::Status& status, const ReconstructionState& state,
                 const CameraRig& initial_rig);
  /// The calibrated drive.
  void showResult(RigCalibrationSession::Status status, const FinishedCalibration& work);

 private:
  const TriangulationOptions triangulation_;
  ros::Publisher status_, trajectory_, landmarks_, cameras_;
};

}  // namespace vcharge
