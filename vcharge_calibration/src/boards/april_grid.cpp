#include "boards/april_grid.h"

#include <map>

#include <opencv2/aruco.hpp>

namespace vcharge {

namespace {

constexpr int kKalibrBorder_cells = 2;
constexpr int kUsualBorder_cells = 1;
// Minimum mean cosine between the directions of a tag's sides and of its neighbours.
constexpr double kMinAgreement = 0.8;

std::map<int, std::vector<cv::Point2f>> detect(const cv::Mat& image, int num_tags, int border_cells) {
  static const cv::Ptr<cv::aruco::Dictionary> kDictionary =
      cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  const cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();
  parameters->markerBorderBits = border_cells;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(image, kDictionary, corners, ids, parameters);
  std::map<int, std::vector<cv::Point2f>> tags;
  for (size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] < num_tags) {
      tags[ids[i]] = corners[i];
    }
  }
  return tags;
}

cv::Point2f middle(const std::vector<cv::Point2f>& corners) {
  return 0.25F * (corners[0] + corners[1] + corners[2] + corners[3]);
}

double cosine(const cv::Point2f& a, const cv::Point2f& b) {
  return a.dot(b) / std::max(1e-9, cv::norm(a) * cv::norm(b));
}

// The detector lists corners clockwise from any corner; the board counter-clockwise from the lower left.
std::vector<cv::Point2f> reordered(const std::vector<cv::Point2f>& corners, int first) {
  std::vector<cv::Point2f> result;
  for (int i = 0; i < 4; ++i) {
    result.push_back(corners[static_cast<size_t>((first - i + 4) % 4)]);
  }
  return result;
}

}  // namespace

std::vector<int> cornersOfTag(const CalibrationBoard& board, int id) {
  const int tag_columns = board.columns / 2;
  const int lower_left = 2 * (id / tag_columns) * board.columns + 2 * (id % tag_columns);
  return {lower_left, lower_left + 1, lower_left + board.columns + 1, lower_left + board.columns};
}

std::vector<SeenTag> findTags(const cv::Mat& image, const CalibrationBoard& board) {
  const int tag_columns = board.columns / 2;
  const int num_tags = board.numCorners() / 4;
  auto tags = detect(image, num_tags, kKalibrBorder_cells);
  if (tags.size() < 2) {
    tags = detect(image, num_tags, kUsualBorder_cells);
  }
  // All tags have the same orientation: the one in which their sides point to their neighbours.
  int best_first = 0;
  double best_agreement = -1.0;
  for (int first = 0; first < 4; ++first) {
    double sum = 0.0;
    int count = 0;
    for (const auto& [id, corners] : tags) {
      const std::vector<cv::Point2f> turned = reordered(corners, first);
      const auto right = tags.find(id + 1);
      if (right != tags.end() && id % tag_columns + 1 < tag_columns) {
        sum += cosine(turned[1] - turned[0], middle(right->second) - middle(corners));
        ++count;
      }
      const auto above = tags.find(id + tag_columns);
      if (above != tags.end()) {
        sum += cosine(turned[3] - turned[0], middle(above->second) - middle(corners));
        ++count;
      }
    }
    if (count > 0 && sum / count > best_agreement) {
      best_agreement = sum / count;
      best_first = first;
    }
  }
  std::vector<SeenTag> seen;
  if (best_agreement < kMinAgreement) {
    return seen;
  }
  for (const auto& [id, corners] : tags) {
    seen.push_back({id, reordered(corners, best_first)});
  }
  return seen;
}

}  // namespace vcharge
