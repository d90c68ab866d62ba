#include "vcharge_reconstruction/tiled_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_reconstruction/map_localizer.h"
#include "vcharge_reconstruction/testing/test_map.h"

namespace vcharge {
namespace {

class TiledMapTest : public ::testing::Test {
 protected:
  TiledMapTest() : path_(::testing::TempDir() + "tiled_map_test.vmap") {
    writeSparseMap(*map_, {}, path_, indexForTiles(*map_));
  }
  ~TiledMapTest() override { std::filesystem::remove(path_); }

  std::shared_ptr<const CameraRig> rig() const { return {map_, &map_->rig()}; }
  std::shared_ptr<const TiledMap> tiles(size_t memory_bytes) const {
    return std::make_shared<const TiledMap>(path_, memory_bytes);
  }
  RigidTransform poseAt(size_t keyframe) const {
    return map_->keyframes()[keyframe].map_from_vehicle * RigidTransform::planar(0.4, 0.1, 0.02);
  }

  const std::shared_ptr<const SparseMap> map_ = testing::makeTestMap({});
  const std::string path_;
};

void expectSame(const PoseFix& a, const PoseFix& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.map_from_vehicle.matrix(), b.map_from_vehicle.matrix());
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.num_matches, b.num_matches);
  EXPECT_EQ(a.numInliers(), b.numInliers());
  EXPECT_EQ(a.second_best_ratio, b.second_best_ratio);
}

// There is no jump where the vehicle crosses tiles, since a pose does not depend on them.
TEST_F(TiledMapTest, PosesAreThoseOfTheMapInMemory) {
  const MapLocalizer whole(std::make_shared<const TiledMap>(map_), rig());
  const MapLocalizer by_tiles(tiles(TiledMap::kDefaultMemory_bytes), rig());
  const MapLocalizer by_few_tiles(tiles(1), rig());  // one at a time
  EXPECT_GT(tilesOf(map_->keyframes()).size(), 3U);
  for (size_t keyframe = 0; keyframe < map_->keyframes().size(); ++keyframe) {
    const RigidTransform truth = poseAt(keyframe);
    const RigFeatures view = testing::makeTestView(*map_, truth, testing::TestViewOptions());
    PosePrior prior;
    prior.map_from_vehicle = truth * RigidTransform::planar(0.1, 0.0, 0.0);
    prior.covariance.diagonal().setConstant(1e-3);
    const PoseFix near = whole.localizeNear(view, prior);
    EXPECT_EQ(near.status, LocalizationStatus::kLocalized);
    expectSame(by_tiles.localizeNear(view, prior), near);
    expectSame(by_few_tiles.localizeNear(view, prior), near);
    const PoseFix anywhere = whole.localizeAnywhere(view);
    EXPECT_EQ(anywhere.status, LocalizationStatus::kLocalized);
    expectSame(by_tiles.localizeAnywhere(view), anywhere);
    expectSame(by_few_tiles.localizeAnywhere(view), anywhere);
  }
}

TEST_F(TiledMapTest, RecognizesPlacesByDescriptorsOfNumbersToo) {
  SparseMapContents contents = map_->contents();
  contents.descriptors = testing::descriptorsAsNumbers(contents.descriptors, 0.1F);
  contents.feature_options = "type: root_sift\n";
  const SparseMap numbers(std::move(contents));
  writeSparseMap(numbers, {}, path_, indexForTiles(numbers));
  const MapLocalizer localizer(tiles(1), rig());
  RigFeatures view = testing::makeTestView(*map_, poseAt(7), testing::TestViewOptions());
  for (ImageFeatures& image : view.images) {
    image.descriptors = testing::descriptorsAsNumbers(image.descriptors, 0.1F);
  }
  EXPECT_EQ(localizer.localizeAnywhere(view).status, LocalizationStatus::kLocalized);
}

TEST_F(TiledMapTest, FindsTheNearestKeyframes) {
  const auto map = tiles(TiledMap::kDefaultMemory_bytes);
  for (const double radius_m : {3.0, 15.0, 60.0}) {
    const Eigen::Vector3d position_m = map_->keyframes()[5].map_from_vehicle.translation();
    const std::vector<size_t> near = map->keyframesNear(position_m, radius_m, 1000);
    double last_m = 0.0;
    for (const size_t i : near) {
      const double distance_m = (map_->keyframes()[i].map_from_vehicle.translation() - position_m).norm();
      EXPECT_GE(distance_m, last_m);
      last_m = distance_m;
    }
    const auto count = std::count_if(map_->keyframes().begin(), map_->keyframes().end(), [&](const auto& k) {
      return (k.map_from_vehicle.translation() - position_m).norm() <= radius_m;
    });
    EXPECT_EQ(near.size(), static_cast<size_t>(count));
    EXPECT_EQ(map->keyframesNear(position_m, radius_m, 2).size(), std::min<size_t>(2, near.size()));
  }
}

TEST_F(TiledMapTest, ADamagedTileIsNamedWhereItIsNeeded) {
  std::string bytes = readTextFile(path_);
  const size_t observation = map_->observationsOf(9, 0).first;
  const auto* descriptor =
      reinterpret_cast<const char*>(map_->descriptors().ptr(static_cast<int>(observation)));
  const size_t at = bytes.find(std::string(descriptor, static_cast<size_t>(map_->descriptors().cols)));
  ASSERT_NE(at, std::string::npos);
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  writeTextFileAtomically(path_, bytes);
  const auto map = tiles(TiledMap::kDefaultMemory_bytes);
  map->prefetch(map_->keyframes()[9].map_from_vehicle.translation(), 5.0);
  try {
    map->tileOf(9);
    FAIL() << "expected an error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("tiled_map_test.vmap: the map is damaged: the tile at"));
  }
  const MapTile damaged = tileAt(map_->keyframes()[9].map_from_vehicle.translation());
  for (const auto& [tile, keyframes] : tilesOf(map_->keyframes())) {
    if (tile < damaged || damaged < tile) {
      EXPECT_EQ(map->tileOf(keyframes[0]).tile->keyframes()[0].id, map_->keyframes()[keyframes[0]].id);
    }
  }
}

TEST_F(TiledMapTest, AFileWithoutTilesIsReadAsAWhole) {
  writeSparseMap(*map_, {}, path_);
  const auto map = tiles(1);
  EXPECT_EQ(map->tileOf(3).index, 3U);
  EXPECT_EQ(map->tileOf(3).tile->contentHash(), map_->contentHash());
}

}  // namespace
}  // namespace vcharge
