#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

struct PatchTrackerOptions {
  VCHARGE_BEGIN_OPTIONS(PatchTrackerOptions);
  VCHARGE_OPTION(int, window_px, 21, between(5, 101),
                 "Side of the square patch on every level, an odd number.");
  VCHARGE_OPTION(int, num_levels, 4, between(1, 10), "Levels of the image pyramid.");
  VCHARGE_OPTION(int, max_iterations, 30, between(1, 100), "Largest number of iterations on a level.");
  VCHARGE_OPTION(double, max_forward_backward_px, 0.5, positive(),
                 "Largest distance from the start after tracking a point forwards and backwards.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;
};

enum class TrackStatus {
  kTracked,
  kLost,          ///< no texture, left the image, or not finite initially
  kInconsistent,  ///< failed the forward-backward check
  kMasked,        ///< found where the mask is 0
};

struct TrackedPoint {
  cv::Point2f position_px;  ///< in the current image; valid if kTracked
  TrackStatus status = TrackStatus::kLost;
};

/// An image pyramid, used first for the current image, then for the previous one.
struct ImagePyramid {
  cv::Size size_px;
  std::vector<cv::Mat> levels;
};

/// Tracks points between images by their patches (Lucas-Kanade on a pyramid, Bouguet 2001; forward-backward
/// check, Kalal, ICPR 2010). Immutable; usable from several threads at once.
class PatchTracker {
 public:
  /// Throws std::invalid_argument for bad options.
  explicit PatchTracker(const PatchTrackerOptions& options = PatchTrackerOptions());

  /// Throws std::invalid_argument unless `image` is a non-empty CV_8UC1.
  ImagePyramid buildPyramid(const cv::Mat& image) const;

  /// Positions in the current image of `points_px` in the previous one; one result per point. The search
  /// starts at `predicted_px`, or at the points themselves if it is empty. `mask` (empty, or CV_8UC1 of the
  /// image's size) belongs to the current image, see makeFeatureMask(). Throws std::invalid_argument naming
  /// the argument for pyramids of different sizes, a wrong mask, or a wrong number of predictions.
  std::vector<TrackedPoint> track(const ImagePyramid& previous, const ImagePyramid& current,
                                  const std::vector<cv::Point2f>& points_px, const cv::Mat& mask = cv::Mat(),
                                  const std::vector<cv::Point2f>& predicted_px = {}) const;

 private:
  const PatchTrackerOptions options_;
};

}  // namespace vcharge
