#include "vcharge_dense/plane_sweep_options.h"

#include <cmath>

namespace vcharge {
namespace {

void requireNotNegative(const char* field, double value) {
  requireField(std::isfinite(value) && value >= 0.0, field, "must be finite and not negative", value);
}

}  // namespace

PoseNoiseOptions PoseNoiseOptions::trajectory() {
  PoseNoiseOptions noise;
  noise.scale = 0.001;
  noise.translation_m = 0.002;
  noise.translation_m_per_sqrt_m = 0.0;
  noise.rotation_rad = 0.0006;
  noise.rotation_rad_per_sqrt_m = 0.0;
  return noise;
}

void PlaneSweepOptions::validate() const {
  requireField(min_distance_m > 0.0, "min_distance_m", "must be positive", min_distance_m);
  requireField(std::isfinite(max_distance_m) && max_distance_m > min_distance_m, "max_distance_m",
               "must be finite and larger than min_distance_m", max_distance_m);
  requireField(num_planes >= 3 && num_planes <= 1024, "num_planes", "must be in [3, 1024]", num_planes);
  requireField(near_spacing >= 1.0 && near_spacing <= 100.0, "near_spacing", "must be in [1, 100]",
               near_spacing);
  requireField(near_spacing == 1.0 || !semi_global_smoothing, "near_spacing",
               "must be 1 with semi_global_smoothing, whose steps are of one size", near_spacing);
  requireField(std::isfinite(ground_min_height_m), "ground_min_height_m", "must be finite",
               ground_min_height_m);
  requireField(std::isfinite(ground_max_height_m) && ground_max_height_m > ground_min_height_m,
               "ground_max_height_m", "must be finite and larger than ground_min_height_m",
               ground_max_height_m);
  requireField(num_ground_planes >= 3 && num_ground_planes <= 1024, "num_ground_planes",
               "must be in [3, 1024]", num_ground_planes);
  requireNotNegative("half_resolution_beyond_m", half_resolution_beyond_m);
  requireField(num_fill_levels >= 0 && num_fill_levels <= 4, "num_fill_levels", "must be in [0, 4]",
               num_fill_levels);
  requireField(smoothness_step >= 0.0 && smoothness_step <= smoothness_jump, "smoothness_step",
               "must be in [0, smoothness_jump]", smoothness_step);
  requireField(smoothness_jump <= 2.0, "smoothness_jump", "must be at most 2", smoothness_jump);
  requireField(window_px >= 3 && window_px <= 31 && window_px % 2 == 1, "window_px",
               "must be odd and in [3, 31]", window_px);
  requireField(best_k >= 1, "best_k", "must be at least 1", best_k);
  requireField(num_refinement_steps >= 0 && num_refinement_steps <= 256 && num_refinement_steps != 1,
               "num_refinement_steps", "must be 0 or in [2, 256]", num_refinement_steps);
  requireField(refinement_step_px > 0.0 && refinement_step_px <= 10.0, "refinement_step_px",
               "must be in (0, 10]", refinement_step_px);
  requireField(warp_tolerance_px >= 0.0 && warp_tolerance_px <= 1.0, "warp_tolerance_px", "must be in [0, 1]",
               warp_tolerance_px);
  requireNotNegative("matching_noise_px", matching_noise_px);
  requireNotNegative("pose_noise.scale", pose_noise.scale);
  requireNotNegative("pose_noise.translation_m", pose_noise.translation_m);
  requireNotNegative("pose_noise.translation_m_per_sqrt_m", pose_noise.translation_m_per_sqrt_m);
  requireNotNegative("pose_noise.rotation_rad", pose_noise.rotation_rad);
  requireNotNegative("pose_noise.rotation_rad_per_sqrt_m", pose_noise.rotation_rad_per_sqrt_m);
  requireNotNegative("min_texture", min_texture);
  requireField(min_score >= -1.0 && min_score < 1.0, "min_score", "must be in [-1, 1)", min_score);
  requireField(max_relative_sigma > 0.0, "max_relative_sigma", "must be positive", max_relative_sigma);
  requireField(min_confidence >= 0.0 && min_confidence < 1.0, "min_confidence", "must be in [0, 1)",
               min_confidence);
}

}  // namespace vcharge
