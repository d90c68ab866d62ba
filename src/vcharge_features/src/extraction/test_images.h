#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace vcharge {

/// A CV_8UC1 texture of random blobs of many sizes, with corners everywhere.
inline cv::Mat randomTexture(cv::Size size, uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat sum = cv::Mat::zeros(size, CV_32FC1);
  for (const int cell_px : {4, 9, 20}) {
    cv::Mat coarse(size.height / cell_px + 2, size.width / cell_px + 2, CV_32FC1), fine;
    random.fill(coarse, cv::RNG::UNIFORM, 0.0, 85.0);
    cv::resize(coarse, fine, size, 0.0, 0.0, cell_px == 4 ? cv::INTER_NEAREST : cv::INTER_LINEAR);
    sum += fine;
  }
  cv::Mat image;
  sum.convertTo(image, CV_8UC1);
  return image;
}

}  // namespace vcharge
