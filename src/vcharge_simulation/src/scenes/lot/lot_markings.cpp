#include "scenes/lot/lot_ground.h"
#include "scenes/lot/marking_painter.h"
#include "scenes/scene_parts.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;

// Both sides of a bay that is angled or parallel to its lane, and the ends of a parallel one.
void addOutline(const PlannedBay& bay, double line_m, MarkingPainter* painter) {
  const bool is_parallel = bay.kind == BayKind::kParallel;
  const double half_length = 0.5 * (is_parallel ? kParallelLength_m : kBayLength_m);
  const double half_width = 0.5 * (is_parallel ? kParallelWidth_m : kBayWidth_m);
  const auto corners = orientedRectangle(bay.x, bay.y, bay.yaw_rad, -half_length, half_length, half_width);
  for (size_t i = 0; i < corners.size(); ++i) {
    if (is_parallel || i % 2 == 0) {
      const Eigen::Vector2d& to = corners[(i + 1) % corners.size()];
      painter->line(corners[i].x(), corners[i].y(), to.x(), to.y(), line_m);
    }
  }
}

}  // namespace

cv::Mat drawLotMarkings(const LotLayout& layout, double texel_m, uint64_t seed) {
  MarkingPainter painter(kLotArea, texel_m);
  constexpr double kLine_m = 0.12;
  for (const LotLayout::Bay& bay : layout.bays) {
    if (bay.kind != BayKind::kPerpendicular) {
      addOutline(bay, kLine_m, &painter);
      continue;
    }
    const double half_x = 0.5 * kBayWidth_m;
    const double half_y = 0.5 * kBayLength_m;
    painter.line(bay.x - half_x, bay.y - half_y, bay.x - half_x, bay.y + half_y, kLine_m);
    painter.line(bay.x + half_x, bay.y - half_y, bay.x + half_x, bay.y + half_y, kLine_m);
    const double mouth = bay.yaw_rad > 0.0 ? -1.0 : 1.0;
    painter.text(std::to_string(100 + bay.number), bay.x, bay.y + mouth * (half_y - 0.35), bay.yaw_rad, 0.35);
  }
  const Lanes& lanes = layout.lanes;
  for (const double y : {-lanes.y_m, lanes.y_m}) {
    painter.dashed(4.0 - lanes.x_m, y, lanes.x_m - 4.0, y, kLine_m, 2.0, 2.7);
    painter.arrow(-18.0, y - 1.5, 0.0);
    painter.arrow(6.0, y + 1.5, 2.0 * kHalfPi);
    painter.arrow(17.0, y - 1.5, 0.0);
  }
  for (const double x : {-lanes.x_m, lanes.x_m}) {
    painter.dashed(x, 4.0 - lanes.y_m, x, lanes.y_m - 4.0, kLine_m, 1.6, 2.2);
    painter.arrow(x + 1.5, -4.0, kHalfPi);
    painter.arrow(x - 1.5, 6.0, -kHalfPi);
  }
  painter.text("LANGSAM", 3.0, -lanes.y_m - 1.4, 0.0, 1.1);
  painter.text("30", -12.0, lanes.y_m + 1.3, 2.0 * kHalfPi, 1.4);
  painter.text("P", lanes.x_m, 1.8 - lanes.y_m, kHalfPi, 1.5);
  for (const double x : {3.2 - lanes.x_m, lanes.x_m - 3.2}) {
    painter.line(x, -1.5, x, 1.5, 0.4);
  }
  Random random(seed);
  for (int i = 0; i < 26; ++i) {
    const double x = random.uniform(-28.0, 28.0);
    const double lane = lanes.y_m * (random.index(3) - 1);
    painter.manhole(x, lane + random.uniform(-2.4, 2.4), random.chance(0.6) ? 0.32 : 0.2);
  }
  return painter.image();
}

}  // namespace vcharge
