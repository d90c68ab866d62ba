#include "vcharge_mapping/map_export.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/analytic_map.h"
#include "vcharge_mapping/map_description.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// Lines of a file without comments, split into words.
std::vector<std::vector<std::string>> readWords(const std::string& path) {
  std::vector<std::vector<std::string>> lines;
  std::istringstream text(readTextFile(path));
  for (std::string line; std::getline(text, line);) {
    if (line.empty() || line[0] != '#') {
      std::istringstream stream(line);
      lines.emplace_back(std::istream_iterator<std::string>(stream), std::istream_iterator<std::string>());
    }
  }
  return lines;
}

class MapExportTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "map_export_test";
    fs::remove_all(folder_);
    createFolder(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  const SparseMap map_{makeAnalyticMap()};
  std::string folder_;
};

TEST_F(MapExportTest, TrajectoryHasThePosesOfTheKeyframes) {
  const Trajectory trajectory = trajectoryOf(map_);
  ASSERT_EQ(trajectory.size(), map_.keyframes().size());
  EXPECT_EQ(trajectory[7].stamp, map_.keyframes()[7].stamp);
  EXPECT_EQ(trajectory[7].world_from_vehicle.translation(),
            map_.keyframes()[7].map_from_vehicle.translation());
}

TEST_F(MapExportTest, PlyHasLandmarksAxesAndThePath) {
  exportPly(map_, folder_ + "/map.ply");
  const auto lines = readWords(folder_ + "/map.ply");
  const size_t num_landmarks = map_.landmarks().size();
  const size_t num_vertices = num_landmarks + 4 * 24;
  const size_t num_edges = 3 * 24 + 23;
  const auto header_end =
      std::find(lines.begin(), lines.end(), std::vector<std::string>{"end_header"}) - lines.begin();
  ASSERT_EQ(lines.size(), static_cast<size_t>(header_end) + 1 + num_vertices + num_edges);
  EXPECT_EQ(lines[3], (std::vector<std::string>{"element", "vertex", std::to_string(num_vertices)}));
  const auto vertex = [&](size_t i) {
    const auto& words = lines[static_cast<size_t>(header_end) + 1 + i];
    return Eigen::Vector3d(std::stod(words[0]), std::stod(words[1]), std::stod(words[2]));
  };
  EXPECT_LT((vertex(10) - map_.landmarks()[10].position_m).norm(), 1e-3);
  // The x axis of the second keyframe is half a metre along its heading, 15 degrees on.
  const Eigen::Vector3d axis = vertex(num_landmarks + 5) - vertex(num_landmarks + 4);
  EXPECT_LT((axis - 0.5 * Eigen::Vector3d(std::cos(M_PI / 12), std::sin(M_PI / 12), 0.0)).norm(), 1e-3);
  for (size_t i = lines.size() - num_edges; i < lines.size(); ++i) {
    EXPECT_LT(std::stoul(lines[i][0]), num_vertices);
    EXPECT_LT(std::stoul(lines[i][1]), num_vertices);
  }
  EXPECT_THROW(exportPly(map_, folder_ + "/none/map.ply"), InputError);
}

// OPENCV_FISHEYE as COLMAP documents it, by itself.
Eigen::Vector2d projectOpencvFisheye(const std::vector<double>& p, const Eigen::Vector3d& point) {
  const double r = std::hypot(point.x() / point.z(), point.y() / point.z());
  const double theta = std::atan(r);
  const double t2 = theta * theta;
  const double d = theta * (1 + t2 * (p[4] + t2 * (p[5] + t2 * (p[6] + t2 * p[7]))));
  return {p[0] * d / r * point.x() / point.z() + p[2], p[1] * d / r * point.y() / point.z() + p[3]};
}

TEST_F(MapExportTest, ColmapModelProjectsItsPointsOntoItsObservations) {
  const ColmapExport result = exportColmap(map_, folder_ + "/model/");
  std::map<std::string, std::vector<double>> cameras;
  for (const auto& words : readWords(folder_ + "/model/cameras.txt")) {
    ASSERT_EQ(words.size(), 12U);
    EXPECT_EQ(words[1], "OPENCV_FISHEYE");
    for (size_t i = 4; i < words.size(); ++i) {
      cameras[words[0]].push_back(std::stod(words[i]));
    }
  }
  ASSERT_EQ(cameras.size(), 2U);
  std::map<std::string, Eigen::Vector3d> points;
  std::map<std::string, std::vector<std::pair<std::string, size_t>>> tracks;
  for (const auto& words : readWords(folder_ + "/model/points3D.txt")) {
    points[words[0]] = {std::stod(words[1]), std::stod(words[2]), std::stod(words[3])};
    EXPECT_LT(std::stod(words[7]), 1e-4) << "the map's own observations are exact but for their rounding";
    for (size_t i = 8; i < words.size(); i += 2) {
      tracks[words[0]].emplace_back(words[i], std::stoul(words[i + 1]));
    }
  }
  EXPECT_EQ(points.size(), result.num_points);
  EXPECT_EQ(result.num_points + result.num_points_left_out, map_.landmarks().size());

  const auto lines = readWords(folder_ + "/model/images.txt");
  ASSERT_EQ(lines.size(), 2 * result.num_images);
  size_t num_observations = 0;
  std::vector<std::string> names;
  for (size_t i = 0; i < lines.size(); i += 2) {
    const auto& image = lines[i];
    const RigidTransform camera_from_map(Eigen::Quaterniond(std::stod(image[1]), std::stod(image[2]),
                                                            std::stod(image[3]), std::stod(image[4])),
                                         {std::stod(image[5]), std::stod(image[6]), std::stod(image[7])});
    const size_t camera = std::stoul(image[8]) - 1;
    names.push_back(image[9]);
    // The fit of the front camera leaves what it says, that of the left camera is exact.
    const double tolerance_px = result.cameras[camera].max_px * 1.1 + 1e-3;
    for (size_t k = 0; k < lines[i + 1].size(); k += 3) {
      const Eigen::Vector2d pixel(std::stod(lines[i + 1][k]), std::stod(lines[i + 1][k + 1]));
      const std::string& point = lines[i + 1][k + 2];
      EXPECT_LT((projectOpencvFisheye(cameras[image[8]], camera_from_map * points.at(point)) - pixel).norm(),
                tolerance_px);
      const auto& track = tracks.at(point);
      EXPECT_NE(std::find(track.begin(), track.end(), std::make_pair(image[0], k / 3)), track.end());
      ++num_observations;
    }
  }
  EXPECT_EQ(num_observations, result.num_observations);
  EXPECT_THAT(names, ::testing::IsSupersetOf({"front/1342626148354042000.png", "left/1342626148354042000.png",
                                              "left/1342626159854042000.png"}));
  EXPECT_EQ(result.num_observations + result.num_observations_left_out, map_.observations().size());
  EXPECT_GT(result.num_observations_left_out, 0U) << "the front camera sees a few degrees behind itself";
  EXPECT_EQ(result.cameras[1].max_px, 0.0);
  EXPECT_GT(result.cameras[0].max_px, 0.0);
  char residual[40];
  std::snprintf(residual, sizeof(residual), "%.4f px rms", result.cameras[0].rms_px);
  EXPECT_THAT(readTextFile(folder_ + "/model/cameras.txt"), HasSubstr(residual));
  EXPECT_NO_THROW(exportColmap(map_, folder_ + "/model")) << "a model may be replaced";
}

TEST_F(MapExportTest, ColmapModelReplacesNothingElse) {
  writeTextFileAtomically(folder_ + "/thesis.txt", "precious");
  try {
    exportColmap(map_, folder_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(folder_), HasSubstr("thesis.txt")));
  }
  EXPECT_EQ(readTextFile(folder_ + "/thesis.txt"), "precious");
  EXPECT_THROW(exportColmap(map_, folder_ + "/thesis.txt"), InputError);
}

TEST(MapDescriptionTest, CountsWhatTheMapHolds) {
  const SparseMap map(makeAnalyticMap());
  const std::string text = describeMap(map, {{"bag", "drive.bag"}, {"options", "a: 1\nb: 2\n"}});
  EXPECT_THAT(text, HasSubstr("content hash  " + map.contentHash()));
  // 23 chords of 15 degrees on 20 m: 2 * 20 m * sin(7.5 degrees) * 23.
  EXPECT_THAT(text, HasSubstr("24 over 120.1 m and 11.5 s, from 1342626148.354042000 on"));
  EXPECT_THAT(text, HasSubstr("landmarks     " + std::to_string(map.landmarks().size()) + "\n"));
  EXPECT_THAT(text, HasSubstr("1 accepted, 1 rejected"));
  EXPECT_THAT(text, HasSubstr("1 rejected: outlier of the pose graph"));
  EXPECT_THAT(text, HasSubstr("distance 1.01250, true over counted turn 0.99219"));
  EXPECT_THAT(text, AllOf(HasSubstr("  bag: drive.bag\n"), HasSubstr("  options: \n    a: 1\n    b: 2\n")));
  // The circle reaches 20 m to both sides and 40 m to the left.
  EXPECT_THAT(text, HasSubstr("path      max     20.00      40.00       0.00"));
  EXPECT_THAT(describeMap(map, {}, true), AllOf(HasSubstr("0 <- 23: "), HasSubstr("none was kept")));
}

TEST(MapDescriptionTest, MeasuresTheReprojectionError) {
  SparseMapContents contents = makeAnalyticMap();
  EXPECT_LT(measureReprojection(SparseMap(contents), 0).rms_px, 1e-4);
  for (MapObservation& observation : contents.observations) {
    observation.position_px += Eigen::Vector2f(3.0F, -4.0F);
  }
  const SparseMap map(contents);
  EXPECT_NEAR(measureReprojection(map, 0).rms_px, 5.0, 1e-3);
  EXPECT_NEAR(measureReprojection(map, 1).rms_px, 5.0, 1e-3);
  EXPECT_EQ(measureReprojection(map, 0).num_observations + measureReprojection(map, 1).num_observations,
            map.observations().size());
}

TEST(MapDescriptionTest, TellsOfAnEmptyMap) {
  SparseMapContents contents;
  contents.rig = makeAnalyticMap().rig;
  const SparseMap map(contents);
  EXPECT_THAT(describeMap(map, {}), AllOf(HasSubstr("keyframes     0"), HasSubstr("0 accepted, 0 rejected")));
  EXPECT_TRUE(trajectoryOf(map).empty());
}

}  // namespace
}  // namespace vcharge
