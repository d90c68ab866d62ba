#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_evaluation/error_distribution.h"

namespace vcharge {

/// Which pixels are judged, and how.
struct RangeEvaluationOptions {
  int pixel_step = 2;  ///< every how many columns and rows a pixel is judged: neighbours say the same
  int texture_window_px = 7;
  double min_texture_gray = 4.0;  ///< standard deviation of the image in the window
  double min_truth_m = 0.5;
  double max_truth_m = 20.0;
  double min_angle_from_travel_rad =
      0.3490658503988659;   ///< 20 degrees, from both ends of the direction of travel
  double tolerance = 0.05;  ///< relative error that counts as right
  std::vector<double> densities = {0.2, 0.4, 0.6, 0.8, 1.0};

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("pixel_step", pixel_step);
    visit("texture_window_px", texture_window_px);
    visit("min_texture_gray", min_texture_gray);
    visit("min_truth_m", min_truth_m);
    visit("max_truth_m", max_truth_m);
    visit("min_angle_from_travel_rad", min_angle_from_travel_rad);
    visit("tolerance", tolerance);
    visit("densities", densities);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Accuracy at a fixed density: of all judged pixels the most confident share is taken; an unknown range
/// counts as wrong, so that leaving pixels out never helps.
struct RangeAccuracy {
  double density = 0.0;
  double share_within_tolerance = 0.0;
  double median_relative_error = 0.0;  ///< of the known ranges among them
  double share_known = 0.0;
};

/// Known ranges by one criterion (true range or confidence) from `low` to `high`.
struct RangeBin {
  double low = 0.0;
  double high = 0.0;
  uint64_t count = 0;
  double share_within_tolerance = 0.0;
  double median_relative_error = 0.0;
  double share_within_one_sigma = 0.0;
};

struct RangeErrors {
  uint64_t num_frames = 0;
  uint64_t num_judged = 0;  ///< pixels that fulfil the options' conditions on image and truth
  uint64_t num_known = 0;   ///< of these, with a range
  std::vector<RangeAccuracy> accuracy;
  double share_within_one_sigma =
      0.0;  ///< of the known ranges; 0.683 where sigma is honest and errors are normal
  double share_within_two_sigma = 0.0;
  std::vector<RangeBin> by_truth;
  std::vector<RangeBin> by_confidence;
};

/// Collects range maps with their truth.
class RangeEvaluator {
 public:
  explicit RangeEvaluator(const RangeEvaluationOptions& options = RangeEvaluationOptions());

  /// image: CV_8UC1 of the working camera; truth_m: CV_32FC1, NaN where nothing was hit; valid: CV_8UC1, 0
  /// where the own vehicle is seen. travel_direction_in_camera is of any length; absent where the vehicle
  /// stands (then no ray is too close to it). std::logic_error when sizes or types differ.
  void add(const RangeMap& map, const cv::Mat& image, const cv::Mat& truth_m, const cv::Mat& valid,
           const std::optional<Eigen::Vector3d>& travel_direction_in_camera);

  RangeErrors errors() const;

 private:
  struct Sample {
    float truth_m;
    float range_m;  // NaN: unknown
    float sigma_m;
    float confidence;
  };
  RangeEvaluationOptions options_;
  uint64_t num_frames_ = 0;
  std::vector<Sample> samples_;
};

}  // namespace vcharge
