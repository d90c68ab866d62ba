#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_features/feature_extractor.h"

namespace vcharge {

/// The features of all cameras at one instant.
struct FeatureFrame {
  Timestamp stamp;
  double travelled_m = 0.0;               ///< by odometry, since the drive's start
  std::vector<ImageFeatures> of_cameras;  ///< in the rig's order
};

/// Extracts the features of a drive's frames about every `spacing_m` of odometry; frames that lack a camera
/// are left out. For tools. InputError for a drive that cannot be read.
std::vector<FeatureFrame> readDriveFeatures(const std::string& bag, std::shared_ptr<const CameraRig> rig,
                                            const FeatureExtractor& extractor, double spacing_m);

}  // namespace vcharge
