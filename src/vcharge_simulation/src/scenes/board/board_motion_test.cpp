#include "scenes/board/board_motion.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/aruco.hpp>

#include "vcharge_simulation/sensors/golf_rig.h"
#include "vcharge_simulation/sensors/rig_catalogue.h"

namespace vcharge {
namespace {

TEST(BoardMotionTest, ShowsEveryCameraOfAnyRigTheWholeBoardOutToTheRim) {
  const auto body = makeGolfBody();
  for (const std::string& board : listBoards()) {
    const BoardPattern pattern = makeBoardPattern(board);
    for (const auto& [name, seed] : {std::pair("golf", 2U), std::pair("random", 1U), std::pair("random", 2U),
                                     std::pair("random", 3U), std::pair("random", 4U)}) {
      const CameraRig rig = makeRig(name, seed, 1.0);
      const BoardMotion motion(rig, *body, pattern.size_m, RigidTransform(), 1);
      for (size_t camera = 0; camera < rig.cameras.size(); ++camera) {
        const std::string label =
            board + ", " + name + " " + std::to_string(seed) + ", " + rig.cameras[camera].name;
        const RigCamera& seeing = rig.cameras[camera];
        double largest_rad = 0.0;
        double smallest_rad = 9.0;
        std::vector<Eigen::Vector3d> positions;
        for (int i = 0; i < BoardMotion::kPosesPerCamera; ++i) {
          const double time_s = static_cast<double>(camera) * BoardMotion::kSpan_s + i + 0.3;
          const RigidTransform camera_from_pattern = seeing.vehicle_from_camera->inverse() *
                                                     motion.worldFromSheet(time_s) *
                                                     pattern.sheet_from_pattern;
          positions.push_back(camera_from_pattern.translation());
          for (const Eigen::Vector3d& corner : pattern.corners_in_pattern_m) {
            const Eigen::Vector3d in_camera = camera_from_pattern * corner;
            const double angle_rad = std::atan2(in_camera.head<2>().norm(), in_camera.z());
            largest_rad = std::max(largest_rad, angle_rad);
            smallest_rad = std::min(smallest_rad, angle_rad);
            ASSERT_LT(angle_rad, 0.5 * seeing.field_of_view_rad) << label;
            Eigen::Vector2d pixel;
            ASSERT_TRUE(seeing.model.project(in_camera, &pixel)) << label;
            EXPECT_TRUE(pixel.x() >= 0.0 && pixel.x() <= 1279.0 && pixel.y() >= 0.0 && pixel.y() <= 799.0)
                << label;
            EXPECT_GT((*seeing.vehicle_from_camera * in_camera).z(), 0.05) << label;
          }
        }
        // The outer squares and the margin extend 0.2 m along the diagonal beyond the corners, at 1.3 m or
        // more.
        EXPECT_GT(largest_rad, 0.5 * seeing.field_of_view_rad - 0.2 / 1.2) << label;
        EXPECT_LT(smallest_rad, 0.1) << label;
        std::sort(positions.begin(), positions.end(),
                  [](const auto& a, const auto& b) { return a.x() < b.x(); });
        const auto distinct =
            std::unique(positions.begin(), positions.end(),
                        [](const auto& a, const auto& b) { return (a - b).norm() < 1e-3; }) -
            positions.begin();
        EXPECT_GE(distinct, 36) << label;
      }
    }
  }
}

TEST(BoardPatternTest, TagsAreThoseOfTheFamilyWhereTheirCornersAre) {
  const BoardPattern pattern = makeBoardPattern("aprilgrid");
  auto parameters = cv::aruco::DetectorParameters::create();
  parameters->markerBorderBits = 2;
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;
  cv::aruco::detectMarkers(pattern.image, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11),
                           corners, ids, parameters);
  ASSERT_EQ(ids.size(), 36U);
  for (size_t i = 0; i < ids.size(); ++i) {
    // OpenCV lists corners clockwise from the upper left one. Its tags are rotated by half a turn, so its
    // first corner is the lower right one on the sheet.
    constexpr size_t kFirst[] = {1, 0, 3, 2};
    for (size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d on_sheet =
          pattern.sheet_from_pattern *
          pattern.corners_in_pattern_m.at(static_cast<size_t>(ids[i]) * 4 + kFirst[k]);
      const Eigen::Vector2d texel =
          (on_sheet.head<2>() + 0.5 * pattern.size_m) * pattern.texels_per_m - Eigen::Vector2d::Constant(0.5);
      EXPECT_NEAR(corners[i][k].x, texel.x(), 1.0) << ids[i] << " " << k;
      EXPECT_NEAR(corners[i][k].y, texel.y(), 1.0) << ids[i] << " " << k;
    }
  }
}

TEST(BoardPatternTest, UnknownBoardIsNamed) {
  try {
    makeBoardPattern("circles");
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("chessboard, aprilgrid"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("circles"), std::string::npos);
  }
}

}  // namespace
}  // namespace vcharge
