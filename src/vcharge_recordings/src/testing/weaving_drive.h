#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge::weaving_drive {

/// Time between images, and their number.
constexpr double kPeriod_s = 0.08;
constexpr int kFrames = 130;
const Timestamp kStart = Timestamp::fromSeconds(1000.0);

/// Pose of a vehicle that weaves to both sides at constant speed, so that its yaw rate changes all the time.
RigidTransform worldFromVehicle(double time_s);

/// Cameras "left" and "right".
CameraRig twoCameras();

/// The images of each camera: a textured wall all around, 15 m away, and a textured ground, with noise.
std::vector<std::vector<cv::Mat>> renderImages();

}  // namespace vcharge::weaving_drive
