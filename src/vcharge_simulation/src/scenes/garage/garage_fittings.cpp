#include "scenes/garage/garage_fittings.h"

#include <cmath>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace vcharge {

namespace {

constexpr double kStopLength_m = 1.7;
constexpr double kStopWidth_m = 0.14;
constexpr double kStopHeight_m = 0.1;
constexpr double kStopToEnd_m = 0.38;  // distance to the end of the bay
constexpr double kBoardHeight_m = 0.28;
constexpr double kBoardWidth_m = 1.7;
constexpr double kTexelsPerM = 150.0;
constexpr double kLowestForBoards_m = 2.5;
constexpr double kPipeRadius_m = 0.055;
constexpr double kPiece_m = 2.0;  // length of the pieces of long objects; each has its own baked light

Eigen::Vector3f vector(double x, double y, double z) {
  return Eigen::Vector3d(x, y, z).cast<float>();
}

// Draws rubber with reflecting stripes, scuffed by tyres.
cv::Mat drawStop(Random* random) {
  cv::Mat image(16, 192, CV_8UC1, cv::Scalar(28));
  for (int x = 8; x < image.cols; x += 48) {
    const std::vector<cv::Point> stripe = {{x, 15}, {x + 14, 15}, {x + 24, 0}, {x + 10, 0}};
    cv::fillPoly(image, std::vector<std::vector<cv::Point>>{stripe}, cv::Scalar(175));
  }
  for (int i = 0; i < 14; ++i) {
    const cv::Point from(random->index(image.cols), random->index(image.rows));
    cv::line(image, from, from + cv::Point(4 + random->index(10), 0), cv::Scalar(40 + random->index(60)));
  }
  return image;
}

void addWheelStops(const std::vector<PlannedBay>& bays, SceneParts* parts) {
  constexpr int kVariants = 6;
  std::vector<uint32_t> materials;
  for (int i = 0; i < kVariants; ++i) {
    materials.push_back(parts->textured(SurfaceKind::kOther, drawStop(&parts->random()), 110.0));
  }
  for (const PlannedBay& bay : bays) {
    const double end = bay.yaw_rad > 0.0 ? 1.0 : -1.0;
    const double y = bay.y + end * (0.5 * kGarageBayLength_m - kStopToEnd_m);
    const double yaw_rad = parts->random().uniform(-0.03, 0.03);
    const uint32_t material = materials[static_cast<size_t>(parts->random().index(kVariants))];
    addBox(placement(bay.x, y, 0.5 * kStopHeight_m, yaw_rad),
           vector(kStopLength_m, kStopWidth_m, kStopHeight_m), material, &parts->scene().mesh);
    parts->scene().obstacles.push_back(
        {"wheel_stop",
         orientedRectangle(bay.x, y, yaw_rad, -0.5 * kStopLength_m, 0.5 * kStopLength_m, 0.5 * kStopWidth_m),
         0.0, kStopHeight_m});
  }
}

cv::Mat drawBoard(const std::string& text, bool bright) {
  cv::Mat image(static_cast<int>(kBoardHeight_m * kTexelsPerM), static_cast<int>(kBoardWidth_m * kTexelsPerM),
                CV_8UC1, cv::Scalar(bright ? 200 : 50));
  const cv::Scalar ink(bright ? 20 : 225);
  cv::rectangle(image, cv::Rect(3, 3, image.cols - 6, image.rows - 6), ink, 2);
  cv::putText(image, text, {14, image.rows - 13}, cv::FONT_HERSHEY_DUPLEX, 0.75, ink, 2, cv::LINE_AA);
  return image;
}

// Boards across the lanes, readable from both sides.
void addBoards(const GaragePlan& plan, SceneParts* parts) {
  if (plan.height_m < kLowestForBoards_m) {
    return;
  }
  struct Sign {
    double x, y;
    bool along_x;  // direction of the lane
    const char* text;
  };
  const double x = plan.lanes.x_m;
  const double y = plan.lanes.y_m;
  const std::vector<Sign> signs = {
      {-19.0, -y, true, "AUSFAHRT ->"},   {-3.5, -y, true, "P2 269 - 285"}, {12.0, -y, true, "<- KASSE"},
      {-19.0, 0.0, true, "P2 201 - 217"}, {4.0, 0.0, true, "LIFT 3 ->"},    {19.5, 0.0, true, "EINBAHN"},
      {-11.5, y, true, "NOTAUSGANG"},     {4.0, y, true, "2,10 m"},         {19.5, y, true, "P2 235 - 251"},
      {-x, -9.0, false, "AUSFAHRT"},      {-x, 9.0, false, "WC / LIFT"},    {x, -9.0, false, "SCHRITT 10"},
      {x, 9.0, false, "P3 P4 ->"}};
  const uint32_t rod = parts->plain(SurfaceKind::kOther, 0.3);
  bool bright = false;
  for (const Sign& sign : signs) {
    bright = !bright;
    const uint32_t material =
        parts->textured(SurfaceKind::kOther, drawBoard(sign.text, bright), kTexelsPerM, 0.03);
    const double low = plan.overhead() + 0.04;
    const auto at = [&](double across, double thickness, double z) {
      return sign.along_x ? vector(sign.x + thickness, sign.y + across, z)
                          : vector(sign.x + across, sign.y + thickness, z);
    };
    const double half = 0.5 * kBoardWidth_m;
    // Seen along the lane's axis, left is at larger y in a lane along x and at smaller x in a lane along y.
    const double left = sign.along_x ? half : -half;
    for (const double side : {-1.0, 1.0}) {
      const double start = -side * left;
      const double depth = 0.03 * side;
      addQuad(at(start, depth, low), at(-start, depth, low), at(-start, depth, low + kBoardHeight_m),
              at(start, depth, low + kBoardHeight_m), material, &parts->scene().mesh);
    }
    for (const double across : {-0.7 * half, 0.7 * half}) {
      addFrustum(at(across, 0.0, low + kBoardHeight_m), at(across, 0.0, plan.height_m), 0.01F, 0.01F, 5,
                 false, rod, &parts->scene().mesh);
    }
  }
}

cv::Mat drawLadder() {
  cv::Mat image(32, 256, CV_8UC1, cv::Scalar(28));
  cv::rectangle(image, cv::Rect(0, 0, 256, 4), cv::Scalar(150), cv::FILLED);
  cv::rectangle(image, cv::Rect(0, 28, 256, 4), cv::Scalar(150), cv::FILLED);
  for (int x = 6; x < image.cols; x += 32) {
    cv::rectangle(image, cv::Rect(x, 0, 5, 32), cv::Scalar(140), cv::FILLED);
  }
  // Cables on the rungs.
  for (const int y : {8, 12, 19, 22}) {
    cv::line(image, {0, y}, {255, y + y % 3 - 1}, cv::Scalar(20 + 10 * (y % 4)), 2);
  }
  return image;
}

void addCableTrays(const GaragePlan& plan, SceneParts* parts) {
  const uint32_t ladder = parts->textured(SurfaceKind::kOther, drawLadder(), 110.0);
  const uint32_t edge = parts->plain(SurfaceKind::kOther, 0.45, 0.04);
  constexpr double kHalf_m = 0.15;
  const double height_m = 2.33 + plan.lift();
  for (const double known_y : {-13.4, 1.9, 17.3}) {
    const double y = plan.shifted(known_y);
    for (double x = plan.area.min_x; x < plan.area.max_x - 1e-6; x += kPiece_m) {
      addQuad(vector(x, y + kHalf_m, height_m), vector(x + kPiece_m, y + kHalf_m, height_m),
              vector(x + kPiece_m, y - kHalf_m, height_m), vector(x, y - kHalf_m, height_m), ladder,
              &parts->scene().mesh);
      addBox(placement(x + 0.5 * kPiece_m, y + kHalf_m, height_m + 0.03, 0.0), vector(kPiece_m, 0.01, 0.06),
             edge, &parts->scene().mesh);
      addBox(placement(x + 0.5 * kPiece_m, y - kHalf_m, height_m + 0.03, 0.0), vector(kPiece_m, 0.01, 0.06),
             edge, &parts->scene().mesh);
    }
  }
}

void addDownPipes(const GarageLayout& layout, SceneParts* parts) {
  constexpr double kPieces_m = 2.2;  // length of the pieces below the last, which ends at the ceiling
  const GaragePlan& plan = layout.plan;
  const uint32_t zinc = parts->plain(SurfaceKind::kPole, 0.4, 0.04);
  const uint32_t clamp = parts->plain(SurfaceKind::kPole, 0.08);
  for (const GarageLayout::Pillar& pillar : layout.pillars) {
    // The pipe is on the side away from the crossing lane.
    const double side = pillar.x > 0.0 ? -1.0 : 1.0;
    if (!parts->random().chance(0.3)) {
      continue;
    }
    const double x = pillar.x + side * (0.5 * plan.pillar_width_m + kPipeRadius_m + 0.01);
    const auto radius = static_cast<float>(kPipeRadius_m);
    for (const double z : {0.0, 0.55, 1.1, 1.65}) {
      addFrustum(vector(x, pillar.y, z), vector(x, pillar.y, z + 0.55), radius, radius, 10, false, zinc,
                 &parts->scene().mesh);
      addFrustum(vector(x, pillar.y, z + 0.36), vector(x, pillar.y, z + 0.4), radius + 0.008F,
                 radius + 0.008F, 10, false, clamp, &parts->scene().mesh);
    }
    if (plan.height_m > kPieces_m) {
      addFrustum(vector(x, pillar.y, kPieces_m), vector(x, pillar.y, plan.height_m), radius, radius, 10,
                 false, zinc, &parts->scene().mesh);
    }
    // Closed at the overhead limit, so that the height map sees it as solid.
    addFrustum(vector(x, pillar.y, plan.overhead() - 0.02), vector(x, pillar.y, plan.overhead() - 0.01),
               radius, radius, 10, true, zinc, &parts->scene().mesh);
    parts->scene().obstacles.push_back(
        {"pipe", circleAround(x, pillar.y, kPipeRadius_m), 0.0, plan.height_m});
  }
}

}  // namespace

void addGarageFittings(const GarageLayout& layout, SceneParts* parts) {
  addWheelStops(layout.bays, parts);
  addBoards(layout.plan, parts);
  addCableTrays(layout.plan, parts);
  addDownPipes(layout, parts);
}

}  // namespace vcharge
