#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Row of a descriptor and its distance: Hamming for CV_8UC1, Euclidean for CV_32FC1. Index -1: none.
struct DescriptorNeighbour {
  int index = -1;
  float distance = 0.0F;
};

/// The two nearest descriptors; ties are ordered by index.
struct TwoNearestDescriptors {
  DescriptorNeighbour best, second;
};

struct DescriptorNeighbours {
  std::vector<TwoNearestDescriptors> of_first;  ///< per row of `first`: its two nearest rows of `second`
  std::vector<DescriptorNeighbour> of_second;   ///< per row of `second`: its nearest row of `first`
};

/// Exhaustive search, vectorized. Binary descriptors give the same result as OpenCV's BFMatcher, including
/// ties. Throws std::invalid_argument naming the argument for descriptors that are neither CV_8UC1 with 32
/// columns nor CV_32FC1, that differ in kind, or are not finite. Empty matrices have no rows of any kind.
DescriptorNeighbours findDescriptorNeighbours(const cv::Mat& first, const cv::Mat& second);

/// Correspondence between a feature of one image and a feature of another.
struct FeatureMatch {
  int first_index = -1;
  int second_index = -1;
  float distance = 0.0F;
};

struct MatchOptions {
  VCHARGE_BEGIN_OPTIONS(MatchOptions);
  VCHARGE_OPTION(double, max_ratio, 0.8, above(0.0).upTo(1.0),
                 "Largest ratio of the nearest to the second nearest distance (Lowe's test; 1: no test).");
  VCHARGE_OPTION(double, max_distance, std::numeric_limits<double>::infinity(), notNegative(),
                 "Largest distance between matching descriptors.");
  VCHARGE_END_OPTIONS();
};

/// Matches of features that are each other's nearest, ordered by first_index. A feature without a second
/// neighbour passes the ratio test; two equal distances do not, unless max_ratio is 1. Throws like
/// findDescriptorNeighbours(), and for bad options.
std::vector<FeatureMatch> matchDescriptors(const cv::Mat& first, const cv::Mat& second,
                                           const MatchOptions& options = MatchOptions());

/// The same, but the candidates in `second` for feature i of `first` are only those within `radius_px` of
/// predicted_positions_px[i]; the ratio and mutual checks consider candidates only. Positions that are not
/// finite never match. Throws std::invalid_argument also for counts that differ from the descriptors', and
/// for a radius that is not finite and positive.
std::vector<FeatureMatch> matchNearPixels(const cv::Mat& first,
                                          const std::vector<cv::Point2f>& predicted_positions_px,
                                          const cv::Mat& second,
                                          const std::vector<cv::Point2f>& second_positions_px,
                                          double radius_px, const MatchOptions& options = MatchOptions());

/// The same for directions: unit rays (3 x N), with candidates within `radius_rad` (below pi).
std::vector<FeatureMatch> matchNearRays(const cv::Mat& first, const Eigen::Matrix3Xd& predicted_rays,
                                        const cv::Mat& second, const Eigen::Matrix3Xd& second_rays,
                                        double radius_rad, const MatchOptions& options = MatchOptions());

}  // namespace vcharge
