#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

struct PatchTrackerOptions {
  int window_px = 21;  ///< side of the patch on every level; odd
  int num_levels = 4;  ///< of the pyramid, each half the size of the one before
  int max_iterations = 30;
  double min_step_px = 0.01;  ///< a smaller step ends the iterations
  /// A patch whose gradients' smaller eigenvalue (per pixel, gray levels over 255) is below has no texture.
  double min_eigenvalue = 1e-4;
  /// Farthest that a point may come back from where it started when it is tracked there and back.
  double max_forward_backward_px = 0.5;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("window_px", window_px);
    visit("num_levels", num_levels);
    visit("max_iterations", max_iterations);
    visit("min_step_px", min_step_px);
    visit("min_eigenvalue", min_eigenvalue);
    visit("max_forward_backward_px", max_forward_backward_px);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

enum class TrackStatus {
  kTracked,
  kLost,          ///< no texture, left the image, or was not finite to begin with
  kInconsistent,  ///< did not come back to where it started
  kMasked,        ///< found where the mask is 0
};

struct TrackedPoint {
  cv::Point2f position_px;  ///< in the current image; meaningful where kTracked
  TrackStatus status = TrackStatus::kLost;
};

/// An image and its smaller versions, made once and used as the current image, then as the previous one.
struct ImagePyramid {
  cv::Size size_px;
  std::vector<cv::Mat> levels;
};

/// Follows points from one image to the next by their patches (Lucas-Kanade on a pyramid, Bouguet 2001;
/// forward-backward check, Kalal, ICPR 2010). Immutable; usable from several threads at once.
class PatchTracker {
 public:
  /// std::invalid_argument for bad options.
  explicit PatchTracker(const PatchTrackerOptions& options = PatchTrackerOptions());

  /// std::invalid_argument unless `image` is a non-empty CV_8UC1.
  ImagePyramid buildPyramid(const cv::Mat& image) const;

  /// Where `points_px` of the previous image are in the current one; one result per point. The search starts
  /// at `predicted_px` where given (empty: at the points themselves). `mask` (empty, or CV_8UC1 of the
  /// image's size) is that of the current image: see makeFeatureMask(). std::invalid_argument naming the
  /// argument for pyramids of different sizes, another mask, or another number of predictions.
  std::vector<TrackedPoint> track(const ImagePyramid& previous, const ImagePyramid& current,
                                  const std::vector<cv::Point2f>& points_px, const cv::Mat& mask = cv::Mat(),
                                  const std::vector<cv::Point2f>& predicted_px = {}) const;

 private:
  const PatchTrackerOptions options_;
};

}  // namespace vcharge
