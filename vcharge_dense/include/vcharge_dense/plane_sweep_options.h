#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Which planes are swept. Fronto-parallel planes face the camera; ground-parallel ones lie at heights about
/// the ground that the vehicle stands on, where they turn the matching window into the surface (paper, Depth
/// Map Computation).
enum class PlaneFamilies { kFrontoParallel, kGroundParallel, kBoth };
template <>
inline std::vector<std::string> enumNames<PlaneFamilies>() {
  return {"fronto_parallel", "ground_parallel", "both"};
}

/// How the scores of the neighbours become the score of a plane.
enum class Aggregation {
  kMean,            ///< mean over the neighbours that see the window
  kReferenceSplit,  ///< better of the means over those before and those after the reference (Kang 2001)
  kBestK,           ///< mean of the best_k best ones
};
template <>
inline std::vector<std::string> enumNames<Aggregation>() {
  return {"mean", "reference_split", "best_k"};
}

/// Random error of the relative pose of two images, one sigma per axis; independent parts add up in squares.
/// The defaults are a wheel odometer's, which is planar while the car pitches, rolls and heaves on its
/// suspension: over the public 118 s of the V-Charge car these grow like a random walk, 0.0012, 0.0017 and
/// 0.0023 rad and 2.4, 3.6 and 5.3 mm (rms) over 0.2, 0.4 and 0.8 m of travel.
struct PoseNoiseOptions {
  double scale = 0.005;                     ///< of all baselines alike: wheel radius
  double translation_m = 0.001;             ///< of any pair
  double translation_m_per_sqrt_m = 0.006;  ///< times the root of the baseline
  double rotation_rad = 0.0002;             ///< of any pair
  double rotation_rad_per_sqrt_m = 0.0026;  ///< times the root of the baseline

  /// Of poses with all six degrees of freedom from mapping: relative ones over 0.2 to 1.2 m are up to 5 mm
  /// wrong along the path, 1 mm across it, and 0.2 to 1.1 mrad (lot, 75 s), as between keyframes odometry
  /// carries them.
  static PoseNoiseOptions trajectory();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("scale", scale);
    visit("translation_m", translation_m);
    visit("translation_m_per_sqrt_m", translation_m_per_sqrt_m);
    visit("rotation_rad", rotation_rad);
    visit("rotation_rad_per_sqrt_m", rotation_rad_per_sqrt_m);
  }
};

/// Options of PlaneSweep. Distances are measured along the plane's normal from the reference camera.
struct PlaneSweepOptions {
  PlaneFamilies families = PlaneFamilies::kBoth;
  double min_distance_m = 0.3;  ///< of the fronto-parallel planes, see near_spacing
  double max_distance_m = 50.0;
  int num_planes = 64;
  /// Distance of neighbouring fronto-parallel planes at min_distance_m over that at max_distance_m, in
  /// inverse distance; it grows evenly in between. More than 1 spends fewer planes on what is near and more
  /// on what is far, where planes further apart than about half a window in the neighbours miss what lies
  /// between them.
  double near_spacing = 1.0;
  double ground_min_height_m =
      -0.3;  ///< of the ground-parallel planes over the ground, uniform in inverse distance
  double ground_max_height_m = 0.3;  ///< below the camera
  int num_ground_planes = 16;

  /// Sweeps at half the resolution first, over every second plane, and then in each tile only the planes near
  /// what that found; all of them where it found little. Fewer planes, less time (package README, Settings).
  bool coarse_pass = false;

  /// The fronto-parallel planes beyond this distance are swept at half the resolution, 0: none of them. The
  /// refinement steps see the whole resolution.
  double half_resolution_beyond_m = 0.0;

  /// Pixels that stay unknown take what a sweep at half the resolution finds there, what that leaves unknown
  /// one at a quarter, and so on, this many times: windows that span more hold more texture (package README,
  /// Filling).
  int num_fill_levels = 0;

  /// Looks for the planes of all pixels together, see the package README (Settings): a step to the next plane
  /// between neighbouring pixels costs smoothness_step of correlation, any other jump smoothness_jump.
  bool semi_global_smoothing = false;
  double smoothness_step = 0.03;
  double smoothness_jump = 0.3;

  int window_px = 7;  ///< odd side of the square matching window (zero-mean normalized cross correlation)
  Aggregation aggregation = Aggregation::kMean;
  int best_k = 2;
  bool sub_plane_interpolation = true;  ///< parabola through the scores, in inverse distance
  /// Samples of the second sweep around the surface that the first one found (0: none). Its steps are step_px
  /// wide in the neighbour that moves most, so that the peak of the score is sampled finely whatever the
  /// baseline.
  int num_refinement_steps = 16;
  double refinement_step_px = 0.5;

  /// The warp over planes is exact on a grid and interpolated between, where that errs by no more than this;
  /// 0: every pixel is projected.
  double warp_tolerance_px = 0.03;

  double matching_noise_px = 0.035;  ///< error of a match that more neighbours do not average out
  PoseNoiseOptions pose_noise;

  /// Corrects the neighbours' relative poses by tracks of image points, within pose_noise; falls back to the
  /// given poses.
  bool refine_poses = false;

  double min_texture = 2.0;  ///< standard deviation of the reference window in gray levels; less is unknown
  double min_score = 0.3;    ///< a lower correlation is unknown
  double max_relative_sigma = 0.5;  ///< a larger standard deviation over range is unobserved
  double min_confidence = 0.25;     ///< probability to be within 5 %; less is unknown
  bool gate = true;                 ///< false keeps every range that some plane explains, for comparisons

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("families", families);
    visit("min_distance_m", min_distance_m);
    visit("max_distance_m", max_distance_m);
    visit("num_planes", num_planes);
    visit("near_spacing", near_spacing);
    visit("ground_min_height_m", ground_min_height_m);
    visit("ground_max_height_m", ground_max_height_m);
    visit("num_ground_planes", num_ground_planes);
    visit("coarse_pass", coarse_pass);
    visit("half_resolution_beyond_m", half_resolution_beyond_m);
    visit("num_fill_levels", num_fill_levels);
    visit("semi_global_smoothing", semi_global_smoothing);
    visit("smoothness_step", smoothness_step);
    visit("smoothness_jump", smoothness_jump);
    visit("window_px", window_px);
    visit("aggregation", aggregation);
    visit("best_k", best_k);
    visit("sub_plane_interpolation", sub_plane_interpolation);
    visit("num_refinement_steps", num_refinement_steps);
    visit("refinement_step_px", refinement_step_px);
    visit("warp_tolerance_px", warp_tolerance_px);
    visit("matching_noise_px", matching_noise_px);
    visit("pose_noise", pose_noise);
    visit("refine_poses", refine_poses);
    visit("min_texture", min_texture);
    visit("min_score", min_score);
    visit("max_relative_sigma", max_relative_sigma);
    visit("min_confidence", min_confidence);
    visit("gate", gate);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

}  // namespace vcharge
