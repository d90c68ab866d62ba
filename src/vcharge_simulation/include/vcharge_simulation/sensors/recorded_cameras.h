#pragma once

#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_simulation/drive/drive_scenario.h"
#include "vcharge_simulation/sensors/camera_view.h"

namespace vcharge {

/// The cameras of a scenario that are recorded: where they are before and after somebody bumped them, and
/// under whose name their images come.
class RecordedCameras {
 public:
  /// Masks are named MASK_FOLDER/CAMERA_mask.png in the rigs. InputError for a camera that the rig does not
  /// have, and for a fault's camera that is not recorded; std::invalid_argument for an unknown rig.
  RecordedCameras(const DriveScenario& scenario, const std::string& mask_folder);

  size_t size() const { return rig_.cameras.size(); }
  const std::string& name(size_t camera) const { return rig_.cameras.at(camera).name; }
  /// In the whole rig: noise does not depend on which cameras are recorded.
  int index(size_t camera) const { return indices_.at(camera); }

  /// The camera as it is mounted at that time.
  const CameraView& view(size_t camera, Duration since_start) const;
  /// Index of the camera under whose name this one's images come.
  size_t plug(size_t camera, Duration since_start) const;

  /// The truth before faults, and with every bump and swap in force, both with masks.
  const CameraRig& rig() const { return rig_; }
  CameraRig rigAfterFaults() const;
  bool isRigFaulty() const { return faults_.bumped_camera.isActive() || faults_.swapped_cameras.isActive(); }

 private:
  size_t partner(size_t camera) const;  // of a swap

  FaultOptions faults_;
  std::vector<int> indices_;
  std::vector<CameraView> views_;
  std::vector<CameraView> bumped_views_;  // the same views where nothing bumps the camera
  CameraRig rig_;
};

}  // namespace vcharge
