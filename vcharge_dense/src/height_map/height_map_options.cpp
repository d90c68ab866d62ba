#include "vcharge_dense/height_map_options.h"

#include <cmath>

namespace vcharge {
namespace {

void requirePositive(const char* field, double value) {
  requireField(std::isfinite(value) && value > 0.0, field, "must be positive", value);
}

void requireNotNegative(const char* field, double value) {
  requireField(std::isfinite(value) && value >= 0.0, field, "must not be negative", value);
}

}  // namespace

void HeightFusionOptions::validate() const {
  requirePositive("cell_size_m", cell_size_m);
  requirePositive("height_step_m", height_step_m);
  requireField(std::isfinite(min_height_m), "min_height_m", "must be finite", min_height_m);
  requireField(std::isfinite(max_height_m) && max_height_m >= min_height_m + 2.0 * height_step_m,
               "max_height_m", "must be two height steps or more above min_height_m", max_height_m);
  requirePositive("max_range_m", max_range_m);
  requireField(min_confidence >= 0.0 && min_confidence <= 1.0, "min_confidence", "must be in [0, 1]",
               min_confidence);
  requirePositive("max_relative_sigma", max_relative_sigma);
  requirePositive("band_m", band_m);
  requirePositive("min_ramp_m", min_ramp_m);
  requirePositive("reference_sigma_m", reference_sigma_m);
  requireField(reference_confidence == 0.0 || (reference_confidence > 0.5 && reference_confidence < 1.0),
               "reference_confidence", "must be 0 or in (0.5, 1)", reference_confidence);
  requireNotNegative("reference_footprint_m", reference_footprint_m);
  requirePositive("free_weight", free_weight);
  requireNotNegative("min_layer_weight_m", min_layer_weight_m);
  requirePositive("min_solid_height_m", min_solid_height_m);
  requirePositive("max_memory_gb", max_memory_gb);
}

void PrimalDualOptions::validate() const {
  requirePositive("max_gap_per_cell", max_gap_per_cell);
  requireField(max_iterations > 0, "max_iterations", "must be positive", max_iterations);
  requirePositive("step_ratio", step_ratio);
}

void HeightRegularizationOptions::validate() const {
  requirePositive("label_lambda", label_lambda);
  requireNotNegative("label_gamma", label_gamma);
  validateInner("label_solver", label_solver);
  requirePositive("height_lambda", height_lambda);
  requirePositive("alpha_up", alpha_up);
  requirePositive("alpha_down", alpha_down);
  requireField(confidence_weighting >= 0.0 && confidence_weighting <= 1.0, "confidence_weighting",
               "must be in [0, 1]", confidence_weighting);
  requirePositive("huber_epsilon_m", huber_epsilon_m);
  validateInner("height_solver", height_solver);
}

void OctomapOptions::validate() const {
  requirePositive("resolution_m", resolution_m);
  requirePositive("max_range_m", max_range_m);
  requireField(pixel_step > 0, "pixel_step", "must be positive", pixel_step);
  requireField(min_confidence >= 0.0 && min_confidence < 1.0, "min_confidence", "must be in [0, 1)",
               min_confidence);
}

void HeightMapOptions::validate() const {
  validateInner("range_maps", range_maps);
  requireNotNegative("min_view_distance_m", min_view_distance_m);
  requireField(min_covered_images >= 0.0 && min_covered_images <= 1.0, "min_covered_images",
               "must be in [0, 1]", min_covered_images);
  validateInner("fusion", fusion);
  validateInner("regularization", regularization);
  validateInner("drivability", drivability);
  validateInner("octomap", octomap);
}

}  // namespace vcharge
