#include "vcharge_features/descriptor_matching.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "matching/descriptor_kernels.h"
#include "matching/matching_internal.h"

namespace vcharge {
namespace {

std::string describeKind(const cv::Mat& descriptors) {
  return cv::typeToString(descriptors.type()) + " with " + std::to_string(descriptors.cols) + " columns";
}

}  // namespace

bool checkDescriptors(const cv::Mat& descriptors, const char* source, const char* argument) {
  const bool binary =
      descriptors.type() == CV_8UC1 && descriptors.cols == static_cast<int>(kBinaryDescriptorBytes);
  if (descriptors.dims > 2 || (!binary && (descriptors.type() != CV_32FC1 || descriptors.cols < 1))) {
    throw std::invalid_argument(std::string(source) + ": " + argument +
                                ": expected 8UC1 with 32 columns or 32FC1, got " + describeKind(descriptors));
  }
  if (!binary && !cv::checkRange(descriptors)) {
    throw std::invalid_argument(std::string(source) + ": " + argument + ": descriptors must be finite");
  }
  return binary;
}

bool checkComparable(const cv::Mat& first, const cv::Mat& second, const char* source) {
  const bool binary = checkDescriptors(first, source, "first");
  checkDescriptors(second, source, "second");
  if (first.type() != second.type() || first.cols != second.cols) {
    throw std::invalid_argument(std::string(source) +
                                ": first and second: expected descriptors of one kind, got " +
                                describeKind(first) + " and " + describeKind(second));
  }
  return binary;
}

DescriptorNeighbours findDescriptorNeighbours(const cv::Mat& first, const cv::Mat& second) {
  DescriptorNeighbours neighbours;
  neighbours.of_first.resize(static_cast<size_t>(first.rows));
  neighbours.of_second.resize(static_cast<size_t>(second.rows));
  if (first.rows > 0) {
    checkDescriptors(first, "findDescriptorNeighbours", "first");
  }
  if (second.rows > 0) {
    checkDescriptors(second, "findDescriptorNeighbours", "second");
  }
  if (first.rows == 0 || second.rows == 0) {
    return neighbours;
  }
  const auto num_first = static_cast<size_t>(first.rows);
  const auto num_second = static_cast<size_t>(second.rows);
  if (checkComparable(first, second, "findDescriptorNeighbours")) {
    findTwoNearestBinary(first.ptr(), first.step, num_first, second.ptr(), second.step, num_second,
                         neighbours.of_first.data(), neighbours.of_second.data());
    return neighbours;
  }
  findTwoNearestFloat(first.ptr<float>(), first.step1(), num_first, second.ptr<float>(), second.step1(),
                      num_second, static_cast<size_t>(first.cols), neighbours.of_first.data(),
                      neighbours.of_second.data());
  for (TwoNearestDescriptors& nearest : neighbours.of_first) {
    nearest.best.distance = std::sqrt(nearest.best.distance);
    nearest.second.distance = std::sqrt(nearest.second.distance);
  }
  for (DescriptorNeighbour& nearest : neighbours.of_second) {
    nearest.distance = std::sqrt(nearest.distance);
  }
  return neighbours;
}

std::vector<FeatureMatch> selectMatches(const DescriptorNeighbours& neighbours, const MatchOptions& options) {
  std::vector<FeatureMatch> matches;
  for (size_t i = 0; i < neighbours.of_first.size(); ++i) {
    const DescriptorNeighbour& best = neighbours.of_first[i].best;
    const DescriptorNeighbour& second = neighbours.of_first[i].second;
    if (best.index < 0 || best.distance > options.max_distance ||
        neighbours.of_second[best.index].index != static_cast<int>(i)) {
      continue;
    }
    const bool distinct =
        options.max_ratio >= 1.0 || second.index < 0 || best.distance < options.max_ratio * second.distance;
    if (distinct) {
      matches.push_back({static_cast<int>(i), best.index, best.distance});
    }
  }
  return matches;
}

std::vector<FeatureMatch> matchDescriptors(const cv::Mat& first, const cv::Mat& second,
                                           const MatchOptions& options) {
  options.validate();
  return selectMatches(findDescriptorNeighbours(first, second), options);
}

}  // namespace vcharge
