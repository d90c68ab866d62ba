#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "extraction/brief_descriptor.h"
#include "extraction/even_selection.h"
#include "extraction/feature_extractors.h"

namespace vcharge {
namespace {

constexpr int kMargin_px = BriefDescriptor::kRadius_px + 1;
/// A binomial filter (sigma 1 px). Twice the blur, as ORB's, costs a fifth of the precision at 2 m on the
/// real images.
constexpr int kBlurWindow_px = 5;

class FastBriefExtractor : public FeatureExtractor {
 public:
  explicit FastBriefExtractor(const FeatureExtractorOptions& options) : FeatureExtractor(options) {}
  int descriptorType() const override { return CV_8UC1; }
  int descriptorColumns() const override { return BriefDescriptor::kBytes; }

 protected:
  ImageFeatures extractChecked(const cv::Mat& image, const cv::Mat& mask) const override;

 private:
  struct Level {
    cv::Mat image;
    double scale = 1.0;           ///< full-size pixels per pixel of the level
    std::vector<cv::Point> kept;  ///< pixels of the level
  };
  std::vector<Level> buildPyramid(const cv::Mat& image) const;
};

/// Pixel centres are at whole coordinates, so corners are at halves.
cv::Point2f atFullSize(cv::Point2f pixel, double scale) {
  return {static_cast<float>((pixel.x + 0.5) * scale - 0.5),
          static_cast<float>((pixel.y + 0.5) * scale - 0.5)};
}

std::vector<FastBriefExtractor::Level> FastBriefExtractor::buildPyramid(const cv::Mat& image) const {
  std::vector<Level> levels;
  double scale = 1.0;
  for (int i = 0; i < options().fast_brief.num_levels; ++i, scale *= options().fast_brief.level_scale) {
    Level level;
    level.scale = scale;
    level.image = image;
    if (i > 0) {
      const cv::Size size(cvRound(image.cols / scale), cvRound(image.rows / scale));
      if (std::min(size.width, size.height) <= 2 * kMargin_px) {
        break;
      }
      cv::resize(levels.back().image, level.image, size, 0.0, 0.0, cv::INTER_LINEAR);
    }
    levels.push_back(std::move(level));
  }
  return levels;
}

ImageFeatures FastBriefExtractor::extractChecked(const cv::Mat& image, const cv::Mat& mask) const {
  ImageFeatures features;
  if (std::min(image.cols, image.rows) <= 2 * kMargin_px) {
    return features;
  }
  std::vector<Level> levels = buildPyramid(image);
  std::vector<SelectionCandidate> candidates;
  std::vector<cv::Point> pixels;
  std::vector<size_t> level_of;
  for (size_t l = 0; l < levels.size(); ++l) {
    const Level& level = levels[l];
    // FAST looks 3 pixels around a corner.
    const cv::Rect inside(kMargin_px - 3, kMargin_px - 3, level.image.cols - 2 * (kMargin_px - 3),
                          level.image.rows - 2 * (kMargin_px - 3));
    std::vector<cv::KeyPoint> corners;
    cv::FAST(level.image(inside), corners, options().fast_brief.threshold, true);
    for (const cv::KeyPoint& corner : corners) {
      const cv::Point pixel(cvRound(corner.pt.x) + inside.x, cvRound(corner.pt.y) + inside.y);
      const cv::Point2f position = atFullSize(pixel, level.scale);
      if (!mask.empty() && mask.at<uint8_t>(std::clamp(cvRound(position.y), 0, mask.rows - 1),
                                            std::clamp(cvRound(position.x), 0, mask.cols - 1)) == 0) {
        continue;
      }
      candidates.push_back({position, corner.response});
      pixels.push_back(pixel);
      level_of.push_back(l);
    }
  }
  const std::vector<int> selected = selectEvenly(candidates, image.size(), options().grid_columns,
                                                 options().grid_rows, options().max_features);
  features.descriptors.create(static_cast<int>(selected.size()), BriefDescriptor::kBytes, CV_8UC1);
  features.keypoints.reserve(selected.size());
  size_t row = 0;
  // Selected indices ascend, hence levels do.
  for (size_t l = 0; l < levels.size(); ++l) {
    cv::Mat smooth;
    cv::GaussianBlur(levels[l].image, smooth, cv::Size(kBlurWindow_px, kBlurWindow_px), 0.0, 0.0,
                     cv::BORDER_REFLECT_101 | cv::BORDER_ISOLATED);
    const BriefDescriptor brief(static_cast<int64_t>(smooth.step));
    for (; row < selected.size() && level_of[selected[row]] == l; ++row) {
      const cv::Point pixel = pixels[selected[row]];
      Keypoint keypoint;
      keypoint.position_px = candidates[selected[row]].position_px;
      keypoint.size_px = static_cast<float>((2 * BriefDescriptor::kRadius_px + 1) * levels[l].scale);
      keypoint.response = candidates[selected[row]].response;
      if (!options().fast_brief.upright) {
        keypoint.angle_rad = BriefDescriptor::intensityCentroidAngle(
            levels[l].image.ptr(pixel.y, pixel.x), static_cast<int64_t>(levels[l].image.step));
      }
      brief.describe(smooth.ptr(pixel.y, pixel.x), keypoint.angle_rad,
                     features.descriptors.ptr(static_cast<int>(row)));
      features.keypoints.push_back(keypoint);
    }
  }
  return features;
}

}  // namespace

std::unique_ptr<FeatureExtractor> makeFastBriefExtractor(const FeatureExtractorOptions& options) {
  return std::make_unique<FastBriefExtractor>(options);
}

}  // namespace vcharge
