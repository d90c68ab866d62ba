#include <cmath>
#include <stdexcept>
#include <string>

#include "matching/descriptor_kernels.h"
#include "matching/matching_internal.h"
#include "matching/radius_search.h"
#include "vcharge_features/descriptor_matching.h"

namespace vcharge {
namespace {

void checkCount(size_t positions, const cv::Mat& descriptors, const char* source, const char* argument) {
  if (positions != static_cast<size_t>(descriptors.rows)) {
    throw std::invalid_argument(std::string(source) + ": " + argument +
                                ": expected one position per descriptor (" +
                                std::to_string(descriptors.rows) + "), got " + std::to_string(positions));
  }
}

void insert(int index, float distance, TwoNearestDescriptors* nearest) {
  // Candidates come in the order of their index, so a tie keeps the earlier one.
  if (nearest->best.index < 0 || distance < nearest->best.distance) {
    nearest->second = nearest->best;
    nearest->best = {index, distance};
  } else if (nearest->second.index < 0 || distance < nearest->second.distance) {
    nearest->second = {index, distance};
  }
}

std::vector<FeatureMatch> matchNearPoints(const cv::Mat& first, const Eigen::Matrix3Xd& predicted,
                                          const cv::Mat& second, const Eigen::Matrix3Xd& positions,
                                          double radius, const MatchOptions& options, const char* source) {
  options.validate();
  checkCount(static_cast<size_t>(predicted.cols()), first, source, "predicted positions");
  checkCount(static_cast<size_t>(positions.cols()), second, source, "second positions");
  if (first.rows == 0 || second.rows == 0) {
    return {};
  }
  const bool binary = checkComparable(first, second, source);
  const RadiusSearch search(positions, radius);
  DescriptorNeighbours neighbours;
  neighbours.of_first.resize(static_cast<size_t>(first.rows));
  neighbours.of_second.resize(static_cast<size_t>(second.rows));
  std::vector<int32_t> candidates;
  std::vector<float> distances;
  for (int i = 0; i < first.rows; ++i) {
    search.find(predicted.col(i), &candidates);
    distances.resize(candidates.size());
    if (binary) {
      hammingToRows(first.ptr(i), second.ptr(), second.step, candidates.data(), candidates.size(),
                    distances.data());
    } else {
      squaredDistanceToRows(first.ptr<float>(i), static_cast<size_t>(first.cols), second.ptr<float>(),
                            second.step1(), candidates.data(), candidates.size(), distances.data());
    }
    for (size_t k = 0; k < candidates.size(); ++k) {
      const float distance = binary ? distances[k] : std::sqrt(distances[k]);
      insert(candidates[k], distance, &neighbours.of_first[i]);
      DescriptorNeighbour& reverse = neighbours.of_second[candidates[k]];
      if (reverse.index < 0 || distance < reverse.distance) {
        reverse = {i, distance};
      }
    }
  }
  return selectMatches(neighbours, options);
}

Eigen::Matrix3Xd toPoints(const std::vector<cv::Point2f>& pixels) {
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(pixels.size()));
  for (size_t i = 0; i < pixels.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = Eigen::Vector3d(pixels[i].x, pixels[i].y, 0.0);
  }
  return points;
}

}  // namespace

std::vector<FeatureMatch> matchNearPixels(const cv::Mat& first,
                                          const std::vector<cv::Point2f>& predicted_positions_px,
                                          const cv::Mat& second,
                                          const std::vector<cv::Point2f>& second_positions_px,
                                          double radius_px, const MatchOptions& options) {
  if (!(std::isfinite(radius_px) && radius_px > 0.0)) {
    throw std::invalid_argument("matchNearPixels: radius_px: must be finite and positive, is " +
                                std::to_string(radius_px));
  }
  return matchNearPoints(first, toPoints(predicted_positions_px), second, toPoints(second_positions_px),
                         radius_px, options, "matchNearPixels");
}

std::vector<FeatureMatch> matchNearRays(const cv::Mat& first, const Eigen::Matrix3Xd& predicted_rays,
                                        const cv::Mat& second, const Eigen::Matrix3Xd& second_rays,
                                        double radius_rad, const MatchOptions& options) {
  if (!(radius_rad > 0.0 && radius_rad < 3.14159265358979323846)) {
    throw std::invalid_argument("matchNearRays: radius_rad: must be in (0, pi), is " +
                                std::to_string(radius_rad));
  }
  // The chord between unit rays increases with their angle.
  return matchNearPoints(first, predicted_rays, second, second_rays, 2.0 * std::sin(0.5 * radius_rad),
                         options, "matchNearRays");
}

}  // namespace vcharge
