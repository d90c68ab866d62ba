#include "vcharge_dense/height_mapper.h"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "height_map/test_views.h"
#include "reference/analytic_scene.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/dense_maps/range_map_file.h"
#include "vcharge_dense/height_map_output.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;
constexpr int kNumImages = 9;
constexpr double kStep_m = 0.25;
constexpr double kMaxRange_m = 8.0;  // length of rays in the OctoMap
const cv::Size kSize(240, 150);

/// A vehicle drives along x over textured ground, with a camera that faces left and downwards.
class HeightMapperTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "height_mapper_test";
    fs::remove_all(folder_);
    auto rig = std::make_shared<CameraRig>();
    rig->cameras.push_back({"left", "camera_left_optical", kSize, MeiCamera(1.1, 150.0, 150.0, 119.5, 74.5),
                            2.6, "", cv::Mat(), testing::cameraPose({1.5, 0.9, 1.0}, 1.57, 0.7),
                            std::nullopt});
    rig_ = rig;
    options_.range_maps.working_camera.image_scale = 1.0;
    options_.min_view_distance_m = 0.2;
    options_.fusion.max_range_m = 3.0;
  }
  void TearDown() override { fs::remove_all(folder_); }

  static Timestamp stampOf(int i) { return Timestamp::fromNanoseconds(1000000000 + int64_t{80000000} * i); }

  static Trajectory poses(int count, double far_m = 0.0) {
    Trajectory trajectory;
    for (int i = 0; i < count; ++i) {
      trajectory.push_back(
          {stampOf(i), RigidTransform::planar(kStep_m * i + (i > 4 ? far_m : 0.0), 0.0, 0.0)});
    }
    return trajectory;
  }

  void drive(HeightMapper* mapper, bool blank = false) const {
    static const AnalyticScene scene({{{0, 0, 0}, {0, 0, 1}}}, 3);
    const RigCamera& camera = rig_->cameras.front();
    for (int i = 0; i < kNumImages; ++i) {
      const RigidTransform pose = RigidTransform::planar(kStep_m * i, 0.0, 0.0) * *camera.vehicle_from_camera;
      const cv::Mat pixels = blank ? cv::Mat(kSize, CV_8UC1, cv::Scalar(90))
                                   : scene.render(std::get<MeiCamera>(camera.model.variant()), kSize, pose,
                                                  1.0, static_cast<uint32_t>(i + 1));
      mapper->addImage(0, stampOf(i), {pixels, nullptr});
    }
  }

  /// The text of the error that finish() throws.
  static std::string errorOf(HeightMapper* mapper) {
    try {
      mapper->finish({});
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  static std::string hashOf(const HeightMap& map) {
    ContentHasher hasher;
    addToHash(map, &hasher);
    return hasher.hex();
  }

  std::string folder_;
  std::shared_ptr<const CameraRig> rig_;
  HeightMapOptions options_;
};

TEST_F(HeightMapperTest, MapsLevelGroundAndResumesAnInterruptedRun) {
  std::string hash;
  {
    HeightMapper mapper(rig_, options_, folder_ + "/work", "drive");
    mapper.setTrajectory(poses(kNumImages));
    drive(&mapper);
    std::map<std::string, std::vector<double>> fractions;
    HeightMapResult result =
        mapper.finish([&](const std::string& step, double fraction) { fractions[step].push_back(fraction); });
    EXPECT_GE(fractions.size(), 2U);
    for (const auto& [step, values] : fractions) {
      EXPECT_TRUE(std::is_sorted(values.begin(), values.end())) << step;
      EXPECT_DOUBLE_EQ(values.back(), 1.0) << step;
    }
    hash = hashOf(result.map);
    EXPECT_EQ(result.map.frame_id, "map");
    EXPECT_TRUE(result.statistics.converged);
    EXPECT_GT(result.statistics.num_observed, 3000U);
    EXPECT_EQ(result.statistics.num_reused, 0U);
    double sum = 0.0, num = 0.0;
    for (const float height : cv::Mat_<float>(result.map.height_m)) {
      sum += std::isnan(height) ? 0.0 : std::abs(height);
      num += std::isnan(height) ? 0.0 : 1.0;
    }
    EXPECT_LT(sum / num, 0.02);
    EXPECT_GT(result.octomap->tree().getNumLeafNodes(), 500U);
    writeHeightMapFolder(&result, folder_ + "/map");
    for (const char* name : {"height_map.tiff", "height_map.yaml", "drivable.pgm", "drivable.yaml",
                             "mesh.ply", "octomap.bt", "height_map.png"}) {
      EXPECT_TRUE(fs::exists(folder_ + "/map/" + name)) << name;
    }
  }
  // An interrupted run: one range map is missing, another has no YAML yet.
  const fs::path maps = fs::directory_iterator(folder_ + "/work")->path();
  const std::vector<Timestamp> stamps = listRangeMaps(maps.string(), "left");
  ASSERT_GT(stamps.size(), 4U);
  for (const char* end : {"_range.tiff", "_sigma.tiff", "_confidence.tiff", "_image.png", ".yaml"}) {
    fs::remove(maps / "left" / (std::to_string(stamps[1].nanoseconds()) + end));
  }
  fs::remove(maps / "left" / (std::to_string(stamps[2].nanoseconds()) + ".yaml"));
  HeightMapper again(rig_, options_, folder_ + "/work", "drive");
  again.setTrajectory(poses(kNumImages));
  drive(&again);
  const HeightMapResult result = again.finish({});
  EXPECT_EQ(result.statistics.num_reused, stamps.size() - 2);
  EXPECT_EQ(hashOf(result.map), hash);
  // With other poses nothing is reused.
  HeightMapper other(rig_, options_, folder_ + "/work", "drive");
  Trajectory moved = poses(kNumImages);
  moved[0].world_from_vehicle = RigidTransform::planar(0.001, 0.0, 0.0);
  other.setTrajectory(moved);
  drive(&other);
  EXPECT_EQ(other.finish({}).statistics.num_reused, 0U);
}

TEST_F(HeightMapperTest, ReportsThatPosesDoNotCoverTheDrive) {
  HeightMapper mapper(rig_, options_, folder_, "");
  mapper.setTrajectory(poses(5));
  drive(&mapper);
  const std::string error = errorOf(&mapper);
  EXPECT_NE(error.find("poses cover 55.6 % of the drive's 9 images, expected at least 90.0 %"),
            std::string::npos)
      << error;
  HeightMapper without(rig_, options_, folder_, "");
  drive(&without);
  EXPECT_NE(errorOf(&without).find("no odometry"), std::string::npos);
}

TEST_F(HeightMapperTest, ReportsThatViewsDoNotOverlap) {
  options_.range_maps.frames.max_speed_m_per_s = 1e9;
  HeightMapper mapper(rig_, options_, folder_, "");
  Trajectory apart;
  for (int i = 0; i < kNumImages; ++i) {
    apart.push_back({stampOf(i), RigidTransform::planar(40.0 * i, 0.0, 0.0)});
  }
  mapper.setTrajectory(apart);
  drive(&mapper);
  const std::string error = errorOf(&mapper);
  EXPECT_NE(error.find("no range map could be made (left: no image with enough baseline"), std::string::npos)
      << error;
}

TEST_F(HeightMapperTest, ReportsThatNoRangeIsConfident) {
  HeightMapper mapper(rig_, options_, folder_, "");
  mapper.setTrajectory(poses(kNumImages));
  drive(&mapper, true);  // no texture: every range is NaN
  const std::string error = errorOf(&mapper);
  EXPECT_NE(error.find("no cell was observed"), std::string::npos) << error;
  EXPECT_NE(error.find("max_range_m"), std::string::npos) << error;
}

TEST_F(HeightMapperTest, RefusesAGridThatIsTooLargeBeforeAnyRangeMap) {
  options_.fusion.cell_size_m = 1e-5;
  HeightMapper mapper(rig_, options_, folder_ + "/work", "");
  mapper.setTrajectory(poses(kNumImages));
  try {
    drive(&mapper);
    FAIL() << "expected an error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("max_memory_gb"), std::string::npos) << error.what();
  }
  EXPECT_FALSE(fs::exists(folder_ + "/work"));
  EXPECT_NE(errorOf(&mapper).find("max_memory_gb"), std::string::npos);
}

TEST_F(HeightMapperTest, ChecksTheGridOfThePosesDuringTheDriveOnly) {
  const HeightMapper mapper(rig_, options_, folder_, "");
  const Trajectory apart = poses(kNumImages, 5e5);  // from the sixth pose on
  EXPECT_THROW(mapper.checkGrid(apart, stampOf(0), stampOf(kNumImages)), InputError);
  EXPECT_NO_THROW(mapper.checkGrid(apart, stampOf(0), stampOf(4)));
  EXPECT_NO_THROW(mapper.checkGrid(apart, stampOf(kNumImages), stampOf(kNumImages + 1)));
}

TEST_F(HeightMapperTest, LeavesNoFolderOnAFullDisk) {
  HeightMapper mapper(rig_, options_, folder_ + "/work", "");
  mapper.setTrajectory(poses(kNumImages));
  drive(&mapper);
  HeightMapResult result = mapper.finish({});
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  for (const rlim_t limit : {rlim_t{100}, rlim_t{20000}, rlim_t{60000}}) {
    rlimit small = old;
    small.rlim_cur = limit;
    setrlimit(RLIMIT_FSIZE, &small);
    EXPECT_THROW(writeHeightMapFolder(&result, folder_ + "/map"), InputError) << limit;
    setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_FALSE(fs::exists(folder_ + "/map")) << limit;
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1) << limit;
  }
  rlimit small = old;
  small.rlim_cur = 100;
  setrlimit(RLIMIT_FSIZE, &small);
  HeightMapper other(rig_, options_, folder_ + "/work2", "");
  other.setTrajectory(poses(kNumImages));
  EXPECT_THROW(drive(&other), InputError);
  setrlimit(RLIMIT_FSIZE, &old);
}

TEST_F(HeightMapperTest, RefusesBadOptionsAndARigWithoutExtrinsics) {
  options_.fusion.free_weight = 0.0;
  try {
    HeightMapper mapper(rig_, options_, folder_, "");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("fusion.free_weight"), std::string::npos);
  }
  auto rig = std::make_shared<CameraRig>(*rig_);
  rig->cameras[0].vehicle_from_camera.reset();
  EXPECT_THROW(HeightMapper(rig, HeightMapOptions(), folder_, ""), InputError);
}

class OctomapBuilderTest : public ::testing::Test {
 protected:
  /// A wall at x = 2 that a camera faces along x; its left half is unknown.
  RangeMap wall() const {
    RangeMap map = testing::blankView(cv::Size(101, 75));
    for (int y = 0; y < map.range_m.rows; ++y) {
      for (int x = 0; x < map.range_m.cols; ++x) {
        const double depth = testing::rayOf(map, x, y).z();
        map.range_m.at<float>(y, x) = x < 50 || depth < 0.3 ? std::nanf("") : static_cast<float>(2.0 / depth);
      }
    }
    return map;
  }
  static OctomapOptions everyPixel() {
    OctomapOptions options;
    options.pixel_step = 1;
    return options;
  }
  static std::string at(const octomap::OcTree& tree, double x, double y, double z) {
    const octomap::OcTreeNode* node = tree.search(x, y, z);
    return node == nullptr ? "unknown" : tree.isNodeOccupied(node) ? "occupied" : "free";
  }
  const RigidTransform along_x_ = testing::cameraPose({0.05, 0.05, 1.05}, 0.0, 0.0);
};

TEST_F(OctomapBuilderTest, ClearsToTheSurfaceOnlyWhereARangeIsKnown) {
  OctomapBuilder builder(everyPixel(), kMaxRange_m, 40.0);
  builder.add(wall(), along_x_);
  EXPECT_EQ(at(builder.tree(), 2.05, -0.45, 1.05), "occupied");  // right half: y < 0
  EXPECT_EQ(at(builder.tree(), 1.05, -0.25, 1.05), "free");
  EXPECT_EQ(at(builder.tree(), 2.35, -0.55, 1.05), "unknown");
  EXPECT_EQ(at(builder.tree(), 2.05, 0.65, 1.05), "unknown");  // the half without ranges
  EXPECT_EQ(at(builder.tree(), 1.05, 0.45, 1.05), "unknown");
}

TEST_F(OctomapBuilderTest, FileIsReadAsItWasWritten) {
  OctomapBuilder builder(everyPixel(), kMaxRange_m, 40.0);
  builder.add(wall(), along_x_);
  const std::string path = ::testing::TempDir() + "octomap_builder_test.bt";
  builder.write(path);
  octomap::OcTree read(1.0);
  ASSERT_TRUE(read.readBinary(path));
  fs::remove(path);
  EXPECT_DOUBLE_EQ(read.getResolution(), 0.1);
  EXPECT_EQ(read.size(), builder.tree().size());
  EXPECT_EQ(at(read, 2.05, -0.45, 1.05), "occupied");
  EXPECT_EQ(at(read, 1.05, -0.25, 1.05), "free");
  EXPECT_EQ(at(read, 1.05, 0.45, 1.05), "unknown");
}

TEST_F(OctomapBuilderTest, LeavesOutRangesOfLowConfidence) {
  RangeMap map = wall();
  map.confidence.setTo(0.69F);
  map.confidence(cv::Rect(0, 0, map.range_m.cols, 40)).setTo(0.71F);  // rays that do not point downwards
  OctomapBuilder builder(everyPixel(), kMaxRange_m, 40.0);
  builder.add(map, along_x_);
  EXPECT_EQ(at(builder.tree(), 2.05, -0.45, 1.25), "occupied");
  EXPECT_EQ(at(builder.tree(), 2.05, -0.45, 0.65), "unknown");
  EXPECT_EQ(at(builder.tree(), 1.05, -0.25, 0.85), "unknown");
}

TEST_F(OctomapBuilderTest, LeavesOutTheFarthestPlaneAndRangesWithoutSigma) {
  OctomapBuilder builder(OctomapOptions(), kMaxRange_m, 1.9);
  builder.add(wall(), along_x_);
  EXPECT_EQ(builder.tree().size(), 0U);
  OctomapBuilder other(OctomapOptions(), kMaxRange_m, 40.0);
  RangeMap map = wall();
  map.standard_deviation_m.setTo(std::nanf(""));
  other.add(map, along_x_);
  map.standard_deviation_m.setTo(0.02F);
  map.range_m.setTo(std::numeric_limits<float>::infinity());
  other.add(map, along_x_);
  EXPECT_EQ(other.tree().size(), 0U);
}

TEST_F(OctomapBuilderTest, EqualsAnOctreeThatIsUpdatedRayByRay) {
  const OctomapOptions options;
  const double max_range_m = 3.0;
  octomap::OcTree plain(options.resolution_m);
  OctomapBuilder builder(options, max_range_m, 40.0);
  const RangeMap map = wall();
  for (int view = 0; view < 7; ++view) {  // enough for voxels to reach the limits of their log odds
    const RigidTransform pose =
        testing::cameraPose({0.05, 0.05 + 0.11 * view, 1.05}, 0.4 * view, 0.05 * view);
    octomap::KeySet ends, free, occupied;
    octomap::KeyRay passed;
    const auto toOctomap = [](const Eigen::Vector3d& p) {
      return octomap::point3d(static_cast<float>(p.x()), static_cast<float>(p.y()),
                              static_cast<float>(p.z()));
    };
    for (int y = 0; y < map.range_m.rows; y += options.pixel_step) {
      for (int x = 0; x < map.range_m.cols; x += options.pixel_step) {
        const double range = map.range_m.at<float>(y, x);
        if (std::isnan(range)) {
          continue;
        }
        const Eigen::Vector3d ray = testing::rayOf(map, x, y).cast<float>().normalized().cast<double>();
        const octomap::point3d end =
            toOctomap(pose.translation() + std::min(range, max_range_m) * (pose.rotation() * ray));
        if (range <= max_range_m) {
          occupied.insert(plain.coordToKey(end));
        }
        if (ends.insert(plain.coordToKey(end)).second) {
          plain.computeRayKeys(toOctomap(pose.translation()), end, passed);
          free.insert(passed.begin(), passed.end());
        }
      }
    }
    for (const octomap::OcTreeKey& key : free) {
      if (occupied.count(key) == 0) {
        plain.updateNode(key, false);
      }
    }
    for (const octomap::OcTreeKey& key : occupied) {
      plain.updateNode(key, true);
    }
    builder.add(map, pose);
  }
  plain.expand();
  ASSERT_GT(plain.getNumLeafNodes(), 3000U);
  EXPECT_EQ(builder.tree().getNumLeafNodes(), plain.getNumLeafNodes());
  size_t occupied = 0;
  for (auto leaf = plain.begin_leafs(); leaf != plain.end_leafs(); ++leaf) {
    const octomap::OcTreeNode* node = builder.tree().search(leaf.getKey());
    ASSERT_NE(node, nullptr);
    ASSERT_EQ(node->getLogOdds(), leaf->getLogOdds());
    occupied += plain.isNodeOccupied(*leaf) ? 1 : 0;
  }
  EXPECT_GT(occupied, 100U);
}

TEST_F(OctomapBuilderTest, RangesBeyondTheLimitClearUpToItAndEndNowhere) {
  OctomapBuilder builder(everyPixel(), 1.0, 40.0);
  builder.add(wall(), along_x_);
  EXPECT_EQ(at(builder.tree(), 0.75, -0.15, 1.05), "free");
  EXPECT_EQ(at(builder.tree(), 2.05, -0.45, 1.05), "unknown");
  EXPECT_GT(builder.tree().size(), 0U);
}

}  // namespace
}  // namespace vcharge
