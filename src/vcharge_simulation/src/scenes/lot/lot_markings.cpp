#include "scenes/lot/lot_ground.h"
#include "scenes/lot/marking_painter.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;

}  // namespace

cv::Mat drawLotMarkings(const LotLayout& layout, double texel_m, uint64_t seed) {
  MarkingPainter painter(kLotArea, texel_m);
  constexpr double kLine_m = 0.12;
  for (const LotLayout::Bay& bay : layout.bays) {
    const double half_x = 0.5 * kBayWidth_m;
    const double half_y = 0.5 * kBayLength_m;
    painter.line(bay.x - half_x, bay.y - half_y, bay.x - half_x, bay.y + half_y, kLine_m);
    painter.line(bay.x + half_x, bay.y - half_y, bay.x + half_x, bay.y + half_y, kLine_m);
    const double mouth = bay.yaw_rad > 0.0 ? -1.0 : 1.0;
    painter.text(std::to_string(100 + bay.number), bay.x, bay.y + mouth * (half_y - 0.35), bay.yaw_rad, 0.35);
  }
  for (const double y : {-15.0, 15.0}) {
    painter.dashed(-22.0, y, 22.0, y, kLine_m, 2.0, 2.7);
    painter.arrow(-18.0, y - 1.5, 0.0);
    painter.arrow(6.0, y + 1.5, 2.0 * kHalfPi);
    painter.arrow(17.0, y - 1.5, 0.0);
  }
  for (const double x : {-26.0, 26.0}) {
    painter.dashed(x, -11.0, x, 11.0, kLine_m, 1.6, 2.2);
    painter.arrow(x + 1.5, -4.0, kHalfPi);
    painter.arrow(x - 1.5, 6.0, -kHalfPi);
  }
  painter.text("LANGSAM", 3.0, -16.4, 0.0, 1.1);
  painter.text("30", -12.0, 16.3, 2.0 * kHalfPi, 1.4);
  painter.text("P", 26.0, -13.2, kHalfPi, 1.5);
  painter.line(-22.8, -1.5, -22.8, 1.5, 0.4);
  painter.line(22.8, -1.5, 22.8, 1.5, 0.4);
  Random random(seed);
  for (int i = 0; i < 26; ++i) {
    const double x = random.uniform(-28.0, 28.0);
    const double lane = 15.0 * (random.index(3) - 1);
    painter.manhole(x, lane + random.uniform(-2.4, 2.4), random.chance(0.6) ? 0.32 : 0.2);
  }
  return painter.image();
}

}  // namespace vcharge
