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
  kOrb,        ///< OpenCV's ORB (Rublee, ICCV 2011)
  kSift,       ///< OpenCV's SIFT (Lowe, IJCV 2004)
  kRootSift,   ///< SIFT compared by the Hellinger kernel (Arandjelovic, CVPR 2012)
  kSurf,       ///< dlib's SURF (Bay, ECCV 2006); a US patent (8,165,401) may still cover it
};
template <>
inline std::vector<std::string> enumNames<FeatureType>() {
  return {"fast_brief", "orb", "sift", "root_sift", "surf"};
}

struct FastBriefOptions {
  int threshold = 20;         ///< gray levels by which a corner's arc differs from its centre
  int num_levels = 1;         ///< of the image pyramid
  double level_scale = 1.41;  ///< size of a level over that of the next
  bool upright = true;  ///< false: turned by the intensity centroid, as ORB's (for cameras that may roll)

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("threshold", threshold);
    visit("num_levels", num_levels);
    visit("level_scale", level_scale);
    visit("upright", upright);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

struct SiftOptions {
  double contrast_threshold = 0.04;  ///< as Lowe's, over all octave layers
  double edge_threshold = 10.0;      ///< largest ratio of principal curvatures
  double sigma_px = 1.6;             ///< blur of the first octave
  int octave_layers = 3;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("contrast_threshold", contrast_threshold);
    visit("edge_threshold", edge_threshold);
    visit("sigma_px", sigma_px);
    visit("octave_layers", octave_layers);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// The defaults are those for localization: the most right matches for the time (README, Results).
struct FeatureExtractorOptions {
  /// For mapping, where accuracy counts and time does not: RootSIFT, half the angular error and more right
  /// matches over wide baselines.
  static FeatureExtractorOptions mapping();

  FeatureType type = FeatureType::kFastBrief;
  int max_features = 1000;
  /// Features are taken from the cells of this grid in turn, the best of each first. Much finer grids spread
  /// them more evenly, but take weaker ones that match worse.
  int grid_columns = 4;
  int grid_rows = 3;
  FastBriefOptions fast_brief;
  SiftOptions sift;
  int orb_threshold = 10;        ///< FAST threshold of ORB, gray levels
  double surf_threshold = 30.0;  ///< smallest determinant of the Hessian, in dlib's units

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("type", type);
    visit("max_features", max_features);
    visit("grid_columns", grid_columns);
    visit("grid_rows", grid_rows);
    visit("fast_brief", fast_brief);
    visit("sift", sift);
    visit("orb_threshold", orb_threshold);
    visit("surf_threshold", surf_threshold);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Finds and describes point features. The same image gives the same features, in the same order, on any
/// number of threads. extract() may be called from several threads at once.
class FeatureExtractor {
 public:
  virtual ~FeatureExtractor() = default;

  /// At most max_features features of `image` (CV_8UC1), at pixels where `mask` (empty, or CV_8UC1 of the
  /// image's size) is not 0, spread over the image. An image too small for a patch gives none.
  /// std::invalid_argument, naming the argument, for an empty image, another type, or another mask.
  ImageFeatures extract(const cv::Mat& image, const cv::Mat& mask = cv::Mat()) const;

  const FeatureExtractorOptions& options() const { return options_; }
  /// CV_8UC1 (256 bits) or CV_32FC1.
  virtual int descriptorType() const = 0;
  /// 32 (bytes), 64 or 128 (numbers).
  virtual int descriptorColumns() const = 0;

 protected:
  explicit FeatureExtractor(const FeatureExtractorOptions& options);
  /// As extract(), for arguments that were checked. Descriptors of no features may be empty.
  virtual ImageFeatures extractChecked(const cv::Mat& image, const cv::Mat& mask) const = 0;

 private:
  const FeatureExtractorOptions options_;
};

/// std::invalid_argument for bad options, and for kSurf in a build without dlib.
std::unique_ptr<FeatureExtractor> makeFeatureExtractor(
    const FeatureExtractorOptions& options = FeatureExtractorOptions());

/// For FeatureExtractor: CV_8UC1 of the camera's image size, 255 where the pixel has a ray within the
/// camera's field of view and its mask is not 0, else 0.
cv::Mat makeFeatureMask(const RigCamera& camera);

}  // namespace vcharge
