#pragma once

#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_simulation/drive/drive_scenario.h"
#include "vcharge_simulation/sensors/camera_view.h"
#include "vcharge_simulation/sensors/readout.h"

namespace vcharge {

/// The recorded cameras of a scenario: their extrinsics before and after a bump, and the name under which
/// their images are recorded.
class RecordedCameras {
 public:
  /// Masks in the rigs are named MASK_FOLDER/CAMERA_mask.png. Throws InputError for a camera that the rig
  /// lacks and for a fault of a camera that is not recorded, std::invalid_argument for an unknown rig.
  RecordedCameras(const DriveScenario& scenario, const std::string& mask_folder);

  size_t size() const { return rig_.cameras.size(); }
  const std::string& name(size_t camera) const { return rig_.cameras.at(camera).name; }
  /// Index in the whole rig: noise does not depend on which cameras are recorded.
  int index(size_t camera) const { return indices_.at(camera); }

  /// The camera with its extrinsics at that time.
  const CameraView& view(size_t camera, Duration since_start) const;
  /// Readout of an image with this window of the vehicle's motion around the common trigger.
  Readout readout(size_t camera, Duration since_start, const MotionWindow& motion) const;
  /// Index of the camera under whose name the images of this one are recorded.
  size_t plug(size_t camera, Duration since_start) const;

  /// True rig with masks, before all faults and after every bump and swap.
  const CameraRig& rig() const { return rig_; }
  CameraRig rigAfterFaults() const;
  bool isRigFaulty() const { return faults_.bumped_camera.isActive() || faults_.swapped_cameras.isActive(); }

 private:
  size_t partner(size_t camera) const;  // the other camera of a swap

  FaultOptions faults_;
  std::vector<int> indices_;
  std::vector<CameraView> views_;
  std::vector<CameraView> bumped_views_;  // equal to views_ for cameras that are not bumped
  CameraRig rig_;
};

}  // namespace vcharge
