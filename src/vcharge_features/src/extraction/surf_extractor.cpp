#include <algorithm>
#include <stdexcept>
#include <vector>

#include "extraction/even_selection.h"
#include "extraction/feature_extractors.h"

#ifdef VCHARGE_HAS_DLIB
#include <dlib/image_keypoint.h>
#include <dlib/opencv.h>
#endif

namespace vcharge {

#ifdef VCHARGE_HAS_DLIB
namespace {

constexpr int kColumns = 64;
/// dlib calls "scale" the sigma of its Hessian; SURF's descriptor covers 20 of them.
constexpr double kSizePerScale = 20.0;

class SurfExtractor : public FeatureExtractor {
 public:
  explicit SurfExtractor(const FeatureExtractorOptions& options) : FeatureExtractor(options) {}
  int descriptorType() const override { return CV_32FC1; }
  int descriptorColumns() const override { return kColumns; }

 protected:
  ImageFeatures extractChecked(const cv::Mat& image, const cv::Mat& mask) const override {
    constexpr double kTwoPi = 6.28318530717958647692;
    const dlib::cv_image<unsigned char> view(image);
    const std::vector<dlib::surf_point> found =
        dlib::get_surf_points(view, 1000000, options().surf_threshold);
    std::vector<SelectionCandidate> candidates;
    std::vector<const dlib::surf_point*> points;
    for (const dlib::surf_point& point : found) {
      const cv::Point pixel(std::clamp(cvRound(point.p.center.x()), 0, image.cols - 1),
                            std::clamp(cvRound(point.p.center.y()), 0, image.rows - 1));
      if (mask.empty() || mask.at<uint8_t>(pixel) != 0) {
        candidates.push_back(
            {cv::Point2f(static_cast<float>(point.p.center.x()), static_cast<float>(point.p.center.y())),
             static_cast<float>(point.p.score)});
        points.push_back(&point);
      }
    }
    const std::vector<int> selected = selectEvenly(candidates, image.size(), options().grid_columns,
                                                   options().grid_rows, options().max_features);
    ImageFeatures features;
    features.descriptors.create(static_cast<int>(selected.size()), kColumns, CV_32FC1);
    for (size_t i = 0; i < selected.size(); ++i) {
      const dlib::surf_point& point = *points[selected[i]];
      const double angle = point.angle < 0.0 ? point.angle + kTwoPi : point.angle;
      features.keypoints.push_back(
          {candidates[selected[i]].position_px, static_cast<float>(kSizePerScale * point.p.scale),
           angle < kTwoPi ? static_cast<float>(angle) : 0.0F, candidates[selected[i]].response});
      for (int k = 0; k < kColumns; ++k) {
        features.descriptors.at<float>(static_cast<int>(i), k) = static_cast<float>(point.des(k));
      }
    }
    return features;
  }
};

}  // namespace

std::unique_ptr<FeatureExtractor> makeSurfExtractor(const FeatureExtractorOptions& options) {
  return std::make_unique<SurfExtractor>(options);
}
#else
std::unique_ptr<FeatureExtractor> makeSurfExtractor(const FeatureExtractorOptions& /*options*/) {
  throw std::invalid_argument("type: surf needs dlib, which was not found when vcharge_features was built");
}
#endif

}  // namespace vcharge
