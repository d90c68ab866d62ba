#include "masks/body_cut.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>

#include "vcharge_core/base/quantile.h"

namespace vcharge::internal {
namespace {

// Mean edge directions have this standard deviation per coordinate on a body, whose shading and reflections
// of itself stay in place. In the scene it is measured.
constexpr float kBodyEdgeSigma = 0.25F;
// Moving structure relative to the image's typical one, which is as likely on a body as in the scene.
constexpr float kEvenMoving = 0.45F;
constexpr float kStillEvidence = 2.0F;
constexpr float kMovingEvidence = 0.4F, kUpperMovingEvidence = 0.7F;
constexpr float kNoEdgeEvidence = 0.25F;
constexpr float kMaxMoving = 1.5F;
constexpr float kMaxEdgeEvidence = 20.0F, kUpperMaxEdgeEvidence = 10.0F;
// Evidence of a pixel relative to an independent one: smoothing correlates neighbours.
constexpr float kIndependence = 0.15F;
// Costs of a cut between neighbours away from static edges and along them.
constexpr float kCutCost = 2.0F;
constexpr float kMinCutCost = 0.05F;
constexpr float kForbidden = 1e4F;
// Length of the mean edge direction of a clear edge, relative to that of the scene's noise.
constexpr float kClearEdge = 4.0F;
constexpr float kWeakEdge = 3.0F, kUpperEdge = 3.0F, kStrongEdge = 7.0F;
// Directions from the optical axis, of which neighbours on both sides decide whether an edge bounds the body.
constexpr int kDirections = 360;
constexpr int kReach = 6;
constexpr int kMaxGap = 25;
constexpr float kBoundedFraction = 0.5F;
// Brightness relative to the ground above which a pixel of the upper half may be sky.
constexpr double kSkyBrightness = 1.5;
// Distance from the border of the field of view and from the body at which static edges are dirt.
constexpr int kBorder_px = 8;
constexpr float kAlwaysThere = 0.7F;
// The body reaches below this fraction of the image height.
constexpr double kLowest = 0.8;
constexpr double kMinBody = 0.0003;

class Evidence {
 public:
  Evidence(const SmallView& view, const StaticStructure& structure) : view_(view), structure_(structure) {
    cv::magnitude(structure.edge_x, structure.edge_y, edge_);
    std::vector<double> ground;
    for (int y = view.size.height / 2; y < view.size.height; ++y) {
      for (int x = 0; x < view.size.width; ++x) {
        if (view.valid.at<uint8_t>(y, x) != 0) {
          ground.push_back(structure.light.at<float>(y, x));
        }
      }
    }
    if (!ground.empty()) {
      sky_level_ = std::min(sky_level_, static_cast<float>(kSkyBrightness * quantile(ground, 0.5)));
    }
  }
  const SmallView& view() const { return view_; }
  /// CV_8UC1, 255 on clear static edges.
  cv::Mat clearEdges() const {
    cv::Mat clear = edge_ > kWeakEdge * structure_.edge_noise;
    const cv::Rect upper(0, 0, clear.cols, clear.rows / 2);
    clear(upper) = edge_(upper) > kUpperEdge * structure_.edge_noise;
    return clear;
  }

  /// CV_8UC1, 255 on strong static edges of the lower half.
  cv::Mat strongEdges() const {
    cv::Mat strong = edge_ > kStrongEdge * structure_.edge_noise;
    strong.rowRange(0, strong.rows / 2).setTo(0);
    return strong;
  }
  /// CV_8UC1, 255 on edges that are in nearly every image.
  cv::Mat alwaysThere() const { return edge_ > kAlwaysThere; }

  /// Log of the likelihood ratio of body and scene.
  float at(int y, int x) const {
    // Sky shows little structure. Images are upright, so it is in their upper half.
    if (y < view_.size.height / 2 && structure_.light.at<float>(y, x) > sky_level_) {
      return -kIndependence;
    }
    const float scene_precision = 1.0F / (sigmaAt(y) * sigmaAt(y));
    const float body_precision = 1.0F / (kBodyEdgeSigma * kBodyEdgeSigma);
    const float edge = edge_.at<float>(y, x);
    const float by_edge =
        std::log(body_precision / scene_precision) + 0.5F * edge * edge * (scene_precision - body_precision);
    const float relative = structure_.moving.at<float>(y, x) / static_cast<float>(structure_.typical_moving);
    const float stillness = std::log(kEvenMoving / std::max(relative, 1e-3F));
    // Glossy paint below the camera reflects the ground, at flat angles with most of its contrast.
    const bool is_upper = y < view_.size.height / 2;
    const float weight = stillness > 0.0F ? kStillEvidence
                         : is_upper       ? kUpperMovingEvidence
                                          : kMovingEvidence;
    const float by_moving = std::clamp(weight * stillness, -kMaxMoving, kMaxMoving);
    // Flat paint has no edges.
    const float least_by_edge = stillness < 0.0F ? -kNoEdgeEvidence : 0.0F;
    return kIndependence *
           (std::clamp(by_edge, least_by_edge, is_upper ? kUpperMaxEdgeEvidence : kMaxEdgeEvidence) +
            structure_.fading.at<float>(y, x) * by_moving);
  }
  /// Cost of a cut between two neighbours; cheap where a static edge runs between them.
  float cutCost(int y, int x, int dy, int dx) const {
    const auto across = [&](int v, int u) {
      return std::abs(structure_.edge_x.at<float>(v, u) * static_cast<float>(dx) +
                      structure_.edge_y.at<float>(v, u) * static_cast<float>(dy));
    };
    const float length = std::hypot(static_cast<float>(dx), static_cast<float>(dy));
    const float edge = std::max(across(y, x), across(y + dy, x + dx)) / length /
                       (kClearEdge * static_cast<float>(structure_.edge_noise));
    return (kMinCutCost + (kCutCost - kMinCutCost) * std::max(0.0F, 1.0F - edge * edge)) / length;
  }

 private:
  /// Standard deviation of edges' directions where nothing stays.
  float sigmaAt(int y) const {
    return static_cast<float>(y < view_.size.height / 2 ? structure_.upper_edge_noise
                                                        : structure_.edge_noise);
  }

  const SmallView& view_;
  const StaticStructure& structure_;
  float sky_level_ = 240.0F;  // saturated
  cv::Mat edge_;
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
  for (int direction = 0; direction < kDirections; ++direction) {
    for (int gap = 2; clear[static_cast<size_t>(direction)] && gap <= kMaxGap; ++gap) {
      if (!clear[static_cast<size_t>((direction + gap) % kDirections)]) {
        continue;
      }
      bool has_body = true;
      for (int step = 1; step < gap; ++step) {
        has_body = has_body && length[static_cast<size_t>((direction + step) % kDirections)] > 0;
      }
      for (int step = 1; has_body && step < gap; ++step) {
        (*keeps)[static_cast<size_t>((direction + step) % kDirections)] = true;
      }
      break;
    }
  }
}

/// Removes the body in directions in which no static edge separates it from the scene, such as smooth sky or
/// asphalt.
void keepBoundedDirections(const Evidence& evidence, cv::Mat* body) {
  const SmallView& view = evidence.view();
  const cv::Mat edges = evidence.clearEdges(), strong = evidence.strongEdges();
  cv::Mat near_edge;
  cv::dilate(edges, near_edge, cv::Mat::ones(3, 3, CV_8U));
  const auto directionOf = [&](int y, int x) {
    const double turn = std::atan2(y - view.centre.y, x - view.centre.x) / (2.0 * CV_PI) + 0.5;
    return std::min(kDirections - 1, static_cast<int>(turn * kDirections));
  };
  std::array<int, kDirections> length{}, bounded{};
  for (int y = 0; y < body->rows; ++y) {
    for (int x = 0; x < body->cols; ++x) {
      const cv::Point inner = cv::Point(x, y) - outward(view, y, x);
      if (body->at<uint8_t>(y, x) != 0 && body->at<uint8_t>(inner) == 0) {
        const auto direction = static_cast<size_t>(directionOf(y, x));
        ++length[direction];
        bounded[direction] += near_edge.at<uint8_t>(y, x) != 0 ? 1 : 0;
      }
    }
  }
  // The outline may be weak where a strong edge is inside.
  for (int y = 0; y < body->rows; ++y) {
    for (int x = 0; x < body->cols; ++x) {
      if (body->at<uint8_t>(y, x) != 0 && strong.at<uint8_t>(y, x) != 0) {
        const auto direction = static_cast<size_t>(directionOf(y, x));
        bounded[direction] = length[direction];
      }
    }
  }
  std::array<bool, kDirections> keeps{};
  for (int direction = 0; direction < kDirections; ++direction) {
    int all = 0, clear = 0;
    for (int step = -kReach; step <= kReach; ++step) {
      const auto other = static_cast<size_t>((direction + step + kDirections) % kDirections);
      all += length[other];
      clear += bounded[other];
    }
    keeps[static_cast<size_t>(direction)] = clear > kBoundedFraction * static_cast<float>(all);
  }
  bridgeGaps(length, &keeps);
  for (int y = 0; y < body->rows; ++y) {
    for (int x = 0; x < body->cols; ++x) {
      if (!keeps[static_cast<size_t>(directionOf(y, x))]) {
        body->at<uint8_t>(y, x) = 0;
      }
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
  // The body reaches into the lower half of the image, to which mirrors are connected.
  const double area = cv::countNonZero(view.valid);
  cv::Mat labels, numbers, centres;
  const int count = cv::connectedComponentsWithStats(regions.body, labels, numbers, centres, 8);
  for (int label = 1; label < count; ++label) {
    const int bottom = numbers.at<int>(label, cv::CC_STAT_TOP) + numbers.at<int>(label, cv::CC_STAT_HEIGHT);
    if (numbers.at<int>(label, cv::CC_STAT_AREA) < kMinBody * area || bottom < kLowest * view.size.height) {
      regions.body.setTo(0, labels == label);
    }
  }
  cv::Mat near_body, inside;
  const cv::Mat around = cv::Mat::ones(2 * kBorder_px + 1, 2 * kBorder_px + 1, CV_8U);
  cv::dilate(regions.body, near_body, around);
  cv::erode(view.valid, inside, around, cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  regions.spots = inside & (near_body == 0) & evidence.alwaysThere();
  return regions;
}

}  // namespace vcharge::internal
