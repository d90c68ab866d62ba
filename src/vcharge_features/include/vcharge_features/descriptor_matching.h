#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// A row of descriptors and its distance: Hamming for CV_8UC1, Euclidean for CV_32FC1. Index -1: there is
/// none.
struct DescriptorNeighbour {
  int index = -1;
  float distance = 0.0F;
};

/// Of one descriptor among others; equal distances are ordered by index.
struct TwoNearestDescriptors {
  DescriptorNeighbour best, second;
};

struct DescriptorNeighbours {
  std::vector<TwoNearestDescriptors> of_first;  ///< per row of `first`: its two nearest rows of `second`
  std::vector<DescriptorNeighbour> of_second;   ///< per row of `second`: its nearest row of `first`
};

/// Exhaustive search, vectorized. Binary descriptors give what OpenCV's BFMatcher gives, ties included.
/// std::invalid_argument naming the argument for descriptors that are neither CV_8UC1 with 32 columns nor
/// CV_32FC1, that differ in kind, or are not finite. Empty matrices are no rows of any kind.
DescriptorNeighbours findDescriptorNeighbours(const cv::Mat& first, const cv::Mat& second);

/// Feature `first_index` of one image shows what feature `second_index` of the other shows.
struct FeatureMatch {
  int first_index = -1;
  int second_index = -1;
  float distance = 0.0F;
};

struct MatchOptions {
  /// Lowe's ratio test: the nearest is at most this times as far as the second nearest. 1: no test.
  double max_ratio = 0.8;
  bool mutual = true;  ///< each must be the other's nearest
  /// Farther pairs are no match. Infinity: no limit.
  double max_distance = std::numeric_limits<double>::infinity();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_ratio", max_ratio);
    visit("mutual", mutual);
    visit("max_distance", max_distance);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Matches in order of first_index. A feature without a second neighbour passes the ratio test; two equal
/// distances do not, unless max_ratio is 1. Errors as findDescriptorNeighbours(), and for bad options.
std::vector<FeatureMatch> matchDescriptors(const cv::Mat& first, const cv::Mat& second,
                                           const MatchOptions& options = MatchOptions());

/// As matchDescriptors(), where second's candidates for feature i of `first` are only those within
/// `radius_px` of predicted_positions_px[i]; the ratio and mutual checks regard candidates alone. A position
/// that is not finite has no candidates and is none. std::invalid_argument besides for counts that do not fit
/// the descriptors, and for a radius that is not finite and positive.
std::vector<FeatureMatch> matchNearPixels(const cv::Mat& first,
                                          const std::vector<cv::Point2f>& predicted_positions_px,
                                          const cv::Mat& second,
                                          const std::vector<cv::Point2f>& second_positions_px,
                                          double radius_px, const MatchOptions& options = MatchOptions());

/// As matchNearPixels() by directions: unit rays (3 x N), candidates within `radius_rad` (below pi).
std::vector<FeatureMatch> matchNearRays(const cv::Mat& first, const Eigen::Matrix3Xd& predicted_rays,
                                        const cv::Mat& second, const Eigen::Matrix3Xd& second_rays,
                                        double radius_rad, const MatchOptions& options = MatchOptions());

}  // namespace vcharge
