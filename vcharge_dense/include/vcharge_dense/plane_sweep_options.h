#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// How the correlations with the neighbours are combined to the score of a plane.
enum class Aggregation {
  kMean,            ///< mean over the neighbours that see the window
  kReferenceSplit,  ///< larger one of the means before and after the reference (Kang et al. 2001)
};
template <>
inline std::vector<std::string> enumNames<Aggregation>() {
  return {"mean", "reference_split"};
}

/// Random error of the relative pose of two images, one standard deviation per axis; independent parts add in
/// squares. The defaults are those of wheel odometry, which is planar while the car pitches, rolls and heaves
/// on its suspension: over the public 118 s of the V-Charge car these errors grow like a random walk, to
/// 0.0012, 0.0017 and 0.0023 rad and 2.4, 3.6 and 5.3 mm (rms) over 0.2, 0.4 and 0.8 m of travel.
struct PoseNoiseOptions {
  VCHARGE_BEGIN_OPTIONS(PoseNoiseOptions);
  VCHARGE_OPTION(double, scale, 0.005, notNegative(), "Relative error common to all baselines.");
  VCHARGE_OPTION(double, translation_m, 0.001, notNegative(), "Position error of any pair of images.");
  VCHARGE_OPTION(double, translation_m_per_sqrt_m, 0.006, notNegative(),
                 "Position error that grows with the square root of the baseline.");
  VCHARGE_OPTION(double, rotation_rad, 0.0002, notNegative(), "Rotation error of any pair of images.");
  VCHARGE_OPTION(double, rotation_rad_per_sqrt_m, 0.0026, notNegative(),
                 "Rotation error that grows with the square root of the baseline.");
  VCHARGE_END_OPTIONS();

  /// Noise of poses that mapping estimated with all six degrees of freedom: over 0.2 to 1.2 m relative poses
  /// are up to 5 mm wrong along the path, 1 mm across it, and 0.2 to 1.1 mrad (simulated lot, 75 s), because
  /// odometry interpolates between keyframes.
  static PoseNoiseOptions trajectory();

  /// Variances per axis of the relative pose of two images at this distance.
  double rotationVariance_rad2(double baseline_m) const {
    return rotation_rad * rotation_rad + rotation_rad_per_sqrt_m * rotation_rad_per_sqrt_m * baseline_m;
  }
  double translationVariance_m2(double baseline_m) const {
    return translation_m * translation_m + translation_m_per_sqrt_m * translation_m_per_sqrt_m * baseline_m;
  }
};

/// How the noise of one neighbour's pose differs from PoseNoiseOptions.
struct NeighbourNoise {
  double rotation_left = 1.0, translation_left = 1.0;  ///< fraction of the variance that a refinement left
  double more_rotation_rad2 = 0.0, more_translation_m2 = 0.0;  ///< variance of other causes, per axis
};

/// Side of the square matching window of zero-mean normalized cross-correlation. Windows of 5 pixels left
/// 3 % fewer cells in height maps, and distances in them were 5.6 instead of 4.5 cm wrong.
constexpr int kMatchingWindow_px = 7;

/// Options of PlaneSweep. Two families of planes are swept: fronto-parallel planes, which face the camera,
/// and planes parallel to the ground, where the matching window has the surface's orientation (paper, section
/// Depth Map Computation). Distances are measured along the planes' normal from the reference camera.
struct PlaneSweepOptions {
  VCHARGE_BEGIN_OPTIONS(PlaneSweepOptions);
  VCHARGE_OPTION(double, min_distance_m, 0.3, positive(), "Distance of the nearest fronto-parallel plane.");
  VCHARGE_OPTION(double, max_distance_m, 50.0, positive(), "Distance of the farthest fronto-parallel plane.");
  VCHARGE_OPTION(int, num_planes, 64, between(3, 1024), "Number of fronto-parallel planes.");
  VCHARGE_OPTION(double, near_spacing, 1.0, between(1, 100),
                 "Ratio of the steps in inverse distance at the nearest and farthest plane; above 1 more "
                 "planes are far.");
  VCHARGE_OPTION(
      int, num_ground_planes, 16, between(0, 1024),
      "Number of planes parallel to the ground, within 0.3 m of it; 0: fronto-parallel planes only.");
  VCHARGE_OPTION(bool, coarse_pass, false, anyValue(),
                 "A sweep at half the resolution first selects the planes of each tile.");
  VCHARGE_OPTION(int, num_fill_levels, 0, between(0, 4),
                 "Number of times that unknown pixels are filled from a sweep at half the resolution.");
  VCHARGE_OPTION(Aggregation, aggregation, Aggregation::kMean, anyValue(),
                 "How the correlations with the neighbours become the score of a plane.");
  VCHARGE_OPTION(int, num_refinement_steps, 16, between(0, 256),
                 "Samples of the second, finer sweep around the surface of the first; 0: no second sweep.");
  VCHARGE_OPTION_GROUP(PoseNoiseOptions, pose_noise, {}, "Random errors of the images' relative poses.");
  VCHARGE_OPTION(
      double, min_texture, 1.0, notNegative(),
      "Standard deviation in gray levels of the reference window below which the range is unknown.");
  VCHARGE_OPTION(
      double, min_confidence, 0.25, atLeast(0.0).below(1.0),
      "Confidence below which a range is unknown; 0: every range is kept that some plane explains.");
  VCHARGE_END_OPTIONS();

  /// Largest error of the interpolated warp between the nodes of a grid; 0 projects every pixel. Not an
  /// option: only tests change it.
  double warp_tolerance_px = 0.03;

  void checkFields() const;
};

}  // namespace vcharge
