#pragma once

#include <cstdint>

#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge::testing {

/// Usual noise of a drive's observations, and their stated deviation.
inline constexpr double kNoise_px = 0.3;

/// Tracks of a front and a left camera that do not overlap, of points on the ground and above it, along a
/// figure of eight of circles of 6 m, keyframes 0.5 m apart; true rig, poses and positions, noisy
/// observations and odometry. In turns the body leans outwards by `lean_rad`. The speed changes along the
/// way, which shows where `timing` is not that of a global shutter.
ReconstructionData makeAnalyticDrive(uint32_t seed, double noise_px, double lean_rad = 0.0,
                                     const ImageTiming& timing = ImageTiming());

}  // namespace vcharge::testing
