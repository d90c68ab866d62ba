#include "masks/body_cut.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>

#include "masks/scene_levels.h"

namespace vcharge::internal {
namespace {

// Mean edge directions have this standard deviation per coordinate on a body, whose shading and reflections
// of itself stay in place. In the scene it is measured.
constexpr float kBodyEdgeSigma = 0.25F;
// Moving structure relative to the scene's at this elevation, which is as likely on a body as in the scene.
constexpr float kEvenMoving = 0.45F;
constexpr float kStillEvidence = 2.0F;
// Glossy paint reflects the scene, at flat angles with most of its contrast.
constexpr float kMovingEvidence = 0.4F;
constexpr float kNoEdgeEvidence = 0.25F;
constexpr float kMaxMoving = 1.5F;
constexpr float kClearlyStill = 0.75F;
constexpr float kMaxEdgeEvidence = 20.0F;
// Evidence of a pixel relative to an independent one: smoothing correlates neighbours.
constexpr float kIndependence = 0.15F;
// Costs of a cut between neighbours away from static edges and along them.
constexpr float kCutCost = 2.0F;
constexpr float kMinCutCost = 0.05F;
constexpr float kForbidden = 1e4F;
// Length of the mean edge direction of a clear edge, relative to that of the scene's noise.
constexpr float kClearEdge = 4.0F;
constexpr float kWeakEdge = 3.0F, kStrongEdge = 7.0F;
// Directions from the optical axis, of which neighbours on both sides decide whether an edge bounds the body.
constexpr size_t kDirections = 360;
constexpr size_t kReach = 6;
constexpr size_t kMaxGap = 25;
constexpr float kBoundedFraction = 0.5F;
// Distance from the border of the field of view and from the body at which static edges are dirt.
constexpr int kBorder_px = 8;
constexpr float kAlwaysThere = 0.7F;
// The body reaches below this fraction of the image height.
constexpr double kLowest = 0.8;
constexpr double kMinBody = 0.0003;

class Evidence {
 public:
  Evidence(const SmallView& view, const StaticStructure& structure)
      : view_(view), structure_(structure), levels_(findSceneLevels(view, structure)) {}
  const SmallView& view() const { return view_; }
  /// CV_8UC1, 255 on clear static edges.
  cv::Mat clearEdges() const { return structure_.edge > kWeakEdge * levels_.edge_noise; }
  /// CV_8UC1, 255 on strong static edges below the horizon.
  cv::Mat strongEdges() const {
    return (structure_.edge > kStrongEdge * levels_.edge_noise) & (levels_.elevation_rad < 0.0);
  }
  bool isBelowHorizon(int y, int x) const { return levels_.elevation_rad.at<float>(y, x) < 0.0F; }
  /// CV_8UC1, 255 on edges that are in nearly every image.
  cv::Mat alwaysThere() const { return structure_.edge > kAlwaysThere; }

  /// Log of the likelihood ratio of body and scene.
  float at(int y, int x) const {
    const float scene_sigma = levels_.edge_noise.at<float>(y, x);
    const float scene_precision = 1.0F / (scene_sigma * scene_sigma);
    const float body_precision = 1.0F / (kBodyEdgeSigma * kBodyEdgeSigma);
    const float edge = structure_.edge.at<float>(y, x);
    const float by_edge =
        std::log(body_precision / scene_precision) + 0.5F * edge * edge * (scene_precision - body_precision);
    const float by_moving = stillnessAt(y, x);
    // Flat paint has no edges.
    const float least_by_edge = by_moving > kNoEdgeEvidence ? 0.0F : -kNoEdgeEvidence;
    return kIndependence * (std::clamp(by_edge, least_by_edge, kMaxEdgeEvidence) + trustAt(y, x) * by_moving);
  }
  /// Weight of the moving structure, which the fading of the lens makes uncertain.
  float trustAt(int y, int x) const { return structure_.fading.at<float>(y, x); }
  /// The part of the moving structure in it.
  float stillnessAt(int y, int x) const {
    const float expected = std::max(levels_.moving.at<float>(y, x), 1e-6F);
    const float relative = structure_.moving.at<float>(y, x) / expected;
    const float stillness = std::log(kEvenMoving / std::max(relative, 1e-3F));
    // Where the scene hardly moves, as clear sky, stillness tells nothing.
    const float significance = std::min(1.0F, expected / static_cast<float>(structure_.typical_moving));
    return significance * std::clamp((stillness > 0.0F ? kStillEvidence : kMovingEvidence) * stillness,
                                     -kMaxMoving, kMaxMoving);
  }
  /// Cost of a cut between two neighbours; cheap where a static edge runs between them.
  float cutCost(int y, int x, int dy, int dx) const {
    const auto across = [&](int v, int u) {
      return std::abs(structure_.edge_x.at<float>(v, u) * static_cast<float>(dx) +
                      structure_.edge_y.at<float>(v, u) * static_cast<float>(dy));
    };
    const float length = std::hypot(static_cast<float>(dx), static_cast<float>(dy));
    const float edge = std::max(across(y, x), across(y + dy, x + dx)) / length /
                       (kClearEdge * levels_.edge_noise.at<float>(y, x));
    return (kMinCutCost + (kCutCost - kMinCutCost) * std::max(0.0F, 1.0F - edge * edge)) / length;
  }

 private:
  const SmallView& view_;
  const StaticStructure& structure_;
  const SceneLevels levels_;
};

/// Whether the pixels of a region are still where the scene moves.
class Stillness {
 public:
  void add(const Evidence& evidence, int y, int x) {
    trust_ += evidence.trustAt(y, x);
    sum_ += evidence.trustAt(y, x) * evidence.stillnessAt(y, x);
  }
  bool isClear(double min_area = 0.0) const { return trust_ > min_area && sum_ > kClearlyStill * trust_; }

 private:
  float trust_ = 0.0F, sum_ = 0.0F;
};

/// Step to the neighbour that is further from the optical axis.
cv::Point outward(const SmallView& view, int y, int x) {
  const cv::Point2f ray(static_cast<float>(x) - view.centre.x, static_cast<float>(y) - view.centre.y);
  const float length = std::hypot(ray.x, ray.y);
  return length < 1.0F ? cv::Point(0, 0) : cv::Point(cvRound(ray.x / length), cvRound(ray.y / length));
}

/// The body is what lies outside of one radius per direction (star-shape prior of Veksler, ECCV 2008):
/// cameras look away from the car, so nothing else is visible behind its outline.
cv::Mat minimumCut(const Evidence& evidence) {
  const cv::Mat& valid = evidence.view().valid;
  cv::Mat index(valid.size(), CV_32SC1, cv::Scalar(-1));
  const int num = cv::countNonZero(valid);
  cv::detail::GCGraph<float> graph(static_cast<unsigned>(num), static_cast<unsigned>(10 * num));
  for (int y = 0; y < valid.rows; ++y) {
    for (int x = 0; x < valid.cols; ++x) {
      if (valid.at<uint8_t>(y, x) == 0) {
        continue;
      }
      const int node = graph.addVtx();
      index.at<int>(y, x) = node;
      const float body = evidence.at(y, x);
      graph.addTermWeights(node, std::max(body, 0.0F), std::max(-body, 0.0F));
      const int back[4][2] = {{0, -1}, {-1, 0}, {-1, -1}, {-1, 1}};
      for (const auto& [dy, dx] : back) {
        if (y + dy >= 0 && x + dx >= 0 && x + dx < valid.cols && index.at<int>(y + dy, x + dx) >= 0) {
          const float cost = evidence.cutCost(y, x, dy, dx);
          graph.addEdges(node, index.at<int>(y + dy, x + dx), cost, cost);
        }
      }
    }
  }
  for (int y = 0; y < valid.rows; ++y) {
    for (int x = 0; x < valid.cols; ++x) {
      const cv::Point next = cv::Point(x, y) + outward(evidence.view(), y, x);
      const bool inside = cv::Rect(cv::Point(), valid.size()).contains(next) && next != cv::Point(x, y);
      if (index.at<int>(y, x) >= 0 && inside && index.at<int>(next) >= 0) {
        graph.addEdges(index.at<int>(y, x), index.at<int>(next), kForbidden, 0.0F);
      }
    }
  }
  graph.maxFlow();
  cv::Mat body = cv::Mat::zeros(valid.size(), CV_8UC1);
  for (int y = 0; y < valid.rows; ++y) {
    for (int x = 0; x < valid.cols; ++x) {
      const int node = index.at<int>(y, x);
      body.at<uint8_t>(y, x) = node >= 0 && graph.inSourceSegment(node) ? 255 : 0;
    }
  }
  return body;
}

/// Keeps directions without a clear edge too if they lie between kept ones.
void bridgeGaps(const std::array<int, kDirections>& length, std::array<bool, kDirections>* keeps) {
  const std::array<bool, kDirections> clear = *keeps;
  for (size_t direction = 0; direction < kDirections; ++direction) {
    for (size_t gap = 2; clear[direction] && gap <= kMaxGap; ++gap) {
      if (!clear[(direction + gap) % kDirections]) {
        continue;
      }
      bool has_body = true;
      for (size_t step = 1; step < gap; ++step) {
        has_body = has_body && length[(direction + step) % kDirections] > 0;
      }
      for (size_t step = 1; has_body && step < gap; ++step) {
        (*keeps)[(direction + step) % kDirections] = true;
      }
      break;
    }
  }
}

/// Removes the body in directions in which neither a static edge separates it from the scene nor all of it is
/// still where the scene moves.
void keepBoundedDirections(const Evidence& evidence, cv::Mat* body) {
  const SmallView& view = evidence.view();
  const cv::Mat strong = evidence.strongEdges();
  cv::Mat near_edge;
  cv::dilate(evidence.clearEdges(), near_edge, cv::Mat::ones(3, 3, CV_8U));
  std::array<int, kDirections> length{}, bounded{};
  std::array<Stillness, kDirections> stillness{};
  std::array<bool, kDirections> has_strong_edge{};
  for (int y = 0; y < body->rows; ++y) {
    for (int x = 0; x < body->cols; ++x) {
      if (body->at<uint8_t>(y, x) == 0) {
        continue;
      }
      const size_t direction = view.sectorOf(y, x, kDirections);
      stillness[direction].add(evidence, y, x);
      has_strong_edge[direction] = has_strong_edge[direction] || strong.at<uint8_t>(y, x) != 0;
      if (body->at<uint8_t>(cv::Point(x, y) - outward(view, y, x)) == 0) {
        ++length[direction];
        bounded[direction] += near_edge.at<uint8_t>(y, x) != 0 ? 1 : 0;
      }
    }
  }
  for (size_t direction = 0; direction < kDirections; ++direction) {
    // The outline may be weak where a strong edge is inside.
    if (has_strong_edge[direction] || stillness[direction].isClear()) {
      bounded[direction] = length[direction];
    }
  }
  std::array<bool, kDirections> keeps{};
  for (size_t direction = 0; direction < kDirections; ++direction) {
    int all = 0, clear = 0;
    for (size_t step = 0; step <= 2 * kReach; ++step) {
      const size_t other = (direction + step + kDirections - kReach) % kDirections;
      all += length[other];
      clear += bounded[other];
    }
    keeps[direction] = static_cast<float>(clear) > kBoundedFraction * static_cast<float>(all);
  }
  bridgeGaps(length, &keeps);
  for (int y = 0; y < body->rows; ++y) {
    for (int x = 0; x < body->cols; ++x) {
      if (!keeps[view.sectorOf(y, x, kDirections)]) {
        body->at<uint8_t>(y, x) = 0;
      }
    }
  }
}

/// Removes small parts, and those that neither reach the bottom of the image, where the body is, nor are
/// still where the scene moves.
void removeDoubtfulParts(const Evidence& evidence, cv::Mat* body) {
  cv::Mat labels, numbers, centres;
  const auto count =
      static_cast<size_t>(cv::connectedComponentsWithStats(*body, labels, numbers, centres, 8));
  std::vector<Stillness> stillness(count);
  for (int y = 0; y < body->rows; ++y) {
    for (int x = 0; x < body->cols; ++x) {
      if (body->at<uint8_t>(y, x) != 0 && evidence.isBelowHorizon(y, x)) {
        stillness[static_cast<size_t>(labels.at<int>(y, x))].add(evidence, y, x);
      }
    }
  }
  const double area = cv::countNonZero(evidence.view().valid);
  for (int label = 1; label < static_cast<int>(count); ++label) {
    const int bottom = numbers.at<int>(label, cv::CC_STAT_TOP) + numbers.at<int>(label, cv::CC_STAT_HEIGHT);
    const bool is_low = bottom >= kLowest * body->rows;
    if (numbers.at<int>(label, cv::CC_STAT_AREA) < kMinBody * area ||
        !(is_low || stillness[static_cast<size_t>(label)].isClear(kMinBody * area))) {
      body->setTo(0, labels == label);
    }
  }
}

}  // namespace

BodyRegions cutBody(const SmallView& view, const StaticStructure& structure) {
  BodyRegions regions;
  regions.spots = cv::Mat::zeros(view.size, CV_8UC1);
  regions.body = cv::Mat::zeros(view.size, CV_8UC1);
  if (structure.typical_moving <= 0.0) {
    return regions;
  }
  const Evidence evidence(view, structure);
  regions.body = minimumCut(evidence);
  keepBoundedDirections(evidence, &regions.body);
  removeDoubtfulParts(evidence, &regions.body);
  cv::Mat near_body, inside;
  const cv::Mat around = cv::Mat::ones(2 * kBorder_px + 1, 2 * kBorder_px + 1, CV_8U);
  cv::dilate(regions.body, near_body, around);
  cv::erode(view.valid, inside, around, cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  regions.spots = inside & (near_body == 0) & evidence.alwaysThere();
  return regions;
}

}  // namespace vcharge::internal
