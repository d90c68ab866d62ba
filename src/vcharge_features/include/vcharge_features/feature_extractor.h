#pragma once

#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_features/image_features.h"

namespace vcharge {

enum class FeatureType {
  kFastBrief,  ///< FAST corners (Rosten, ECCV 2006), BRIEF bits (Calonder, ECCV 2010): the fastest
  kRootSift,   ///< OpenCV's SIFT (Lowe, IJCV 2004) compared by the Hellinger kernel (Arandjelovic, CVPR 2012)
};
template <>
inline std::vector<std::string> enumNames<FeatureType>() {
  return {"fast_brief", "root_sift"};
}

/// The defaults are those for localization, with the most right matches for the time.
struct FeatureExtractorOptions {
  VCHARGE_BEGIN_OPTIONS(FeatureExtractorOptions);
  VCHARGE_OPTION(FeatureType, type, FeatureType::kFastBrief, anyValue(), "Detector and descriptor.");
  VCHARGE_OPTION(int, max_features, 1000, between(1, 1000000), "Largest number of features in an image.");
  VCHARGE_OPTION(
      int, fast_threshold, 20, between(1, 254),
      "Gray levels between a FAST corner and its surroundings; half of it in images with few corners.");
  VCHARGE_OPTION(double, sift_contrast_threshold, 0.04, between(0.0, 1.0),
                 "Contrast of a SIFT feature, as defined by Lowe.");
  VCHARGE_END_OPTIONS();

  /// For mapping, where accuracy is more important than time: RootSIFT has half the angular error and more
  /// right matches over wide baselines.
  static FeatureExtractorOptions mapping();
};

/// Detects and describes point features. The same image gives the same features, in the same order, on any
/// number of threads. extract() may be called from several threads at once.
class FeatureExtractor {
 public:
  virtual ~FeatureExtractor() = default;

  /// At most max_features features of `image` (CV_8UC1), spread over the pixels where `mask` (empty, or
  /// CV_8UC1 of the same size) is not 0. An image smaller than a patch has none. Throws std::invalid_argument
  /// naming the argument for an empty image, another type, or a mask of another type or size.
  ImageFeatures extract(const cv::Mat& image, const cv::Mat& mask = cv::Mat()) const;

  const FeatureExtractorOptions& options() const { return options_; }
  /// CV_8UC1 (256 bits) or CV_32FC1.
  virtual int descriptorType() const = 0;
  /// 32 (bytes) or 128 (numbers).
  virtual int descriptorColumns() const = 0;

 protected:
  explicit FeatureExtractor(const FeatureExtractorOptions& options);
  /// extract() for arguments that were checked. Without features, the descriptors may be empty.
  virtual ImageFeatures extractChecked(const cv::Mat& image, const cv::Mat& mask) const = 0;

 private:
  const FeatureExtractorOptions options_;
};

/// Throws std::invalid_argument for bad options.
std::unique_ptr<FeatureExtractor> makeFeatureExtractor(
    const FeatureExtractorOptions& options = FeatureExtractorOptions());

/// Mask for FeatureExtractor: CV_8UC1 of the camera's image size, 255 where the pixel has a ray within the
/// camera's field of view and the camera's mask is not 0, otherwise 0.
cv::Mat makeFeatureMask(const RigCamera& camera);

}  // namespace vcharge
