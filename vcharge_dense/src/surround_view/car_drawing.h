#pragma once

#include <opencv2/core.hpp>

#include "surround_view/view_grid.h"

namespace vcharge {

/// The vehicle from above: a dark body with rounded corners, a lighter rim and light windows. It is
/// translucent, so that the ground below it can be seen where it is known.
class CarDrawing {
 public:
  explicit CarDrawing(const ViewGrid& grid);

  /// Draws it over an image of the view.
  void draw(cv::Mat* image) const;

 private:
  cv::Rect region_;
  cv::Mat gray_, opacity_;  // CV_8UC1, of the region
};

}  // namespace vcharge
