#include "vcharge_core/sparse_map/map_tile_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/analytic_map.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;

MapIndex indexWithTwoRows() {
  MapIndex index;
  index.info = {{"kind", "test"}};
  index.writePlaceRows = [](const MapIndex::PutRow& put) {
    put(3, {1, 2, 3});
    put(70, {});
  };
  return index;
}

class MapTileTest : public ::testing::Test {
 protected:
  MapTileTest() : folder_(::testing::TempDir() + "map_tile_test"), path_(folder_ + "/a.vmap") {
    std::filesystem::create_directories(folder_);
    writeSparseMap(map_, {}, path_, index_);
  }
  ~MapTileTest() override { std::filesystem::remove_all(folder_); }

  void runSql(const std::string& sql) const {
    sqlite3* handle = nullptr;
    ASSERT_EQ(sqlite3_open(path_.c_str(), &handle), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(handle, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
    sqlite3_close(handle);
  }

  std::string errorOfTiles() const {
    try {
      const auto reader = MapTileReader::open(path_);
      for (const auto& [tile, keyframes] : reader->tiles()) {
        reader->readTile(tile);
      }
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }

  const SparseMap map_{makeAnalyticMap()};
  const MapIndex index_ = indexWithTwoRows();
  const std::string folder_, path_;
};

TEST(MapTile, IsTheSquareThatAPositionLiesIn) {
  const auto at = [](double x_m, double y_m) {
    const MapTile tile = tileAt({x_m, y_m, 5.0});
    return std::make_pair(tile.x, tile.y);
  };
  EXPECT_EQ(at(0.0, 19.9), std::make_pair(0, 0));
  EXPECT_EQ(at(20.0, -0.1), std::make_pair(1, -1));
  EXPECT_GT(at(1e300, 0.0).first, 1 << 30);
}

TEST_F(MapTileTest, TilesAreThePartsOfTheMap) {
  const auto reader = MapTileReader::open(path_);
  ASSERT_NE(reader, nullptr);
  EXPECT_EQ(reader->overview().keyframes.size(), map_.keyframes().size());
  EXPECT_EQ(reader->overview().feature_options, map_.contents().feature_options);
  EXPECT_EQ(reader->overview().rig.cameras.size(), map_.rig().cameras.size());
  EXPECT_EQ(reader->info().at("kind"), "test");
  EXPECT_GT(reader->tiles().size(), 3U);  // the circle has a diameter of 40 m
  size_t num_observations = 0;
  std::set<int32_t> landmarks;
  for (const auto& [tile, keyframes] : reader->tiles()) {
    const auto part = reader->readTile(tile);
    EXPECT_EQ(part->contentHash(), partOf(map_, keyframes)->contentHash());
    ASSERT_EQ(part->keyframes().size(), keyframes.size());
    for (size_t i = 0; i < keyframes.size(); ++i) {
      EXPECT_EQ(part->keyframes()[i].id, map_.keyframes()[keyframes[i]].id);
      for (size_t camera = 0; camera < map_.rig().cameras.size(); ++camera) {
        const auto [begin, end] = part->observationsOf(i, camera);
        const auto [whole_begin, whole_end] = map_.observationsOf(keyframes[i], camera);
        ASSERT_EQ(end - begin, whole_end - whole_begin);
        for (size_t k = 0; k < end - begin; ++k) {
          const MapObservation& here = part->observations()[begin + k];
          const MapObservation& there = map_.observations()[whole_begin + k];
          const MapLandmark& landmark = part->landmarks()[static_cast<size_t>(here.landmark)];
          EXPECT_EQ(landmark.id, map_.landmarks()[static_cast<size_t>(there.landmark)].id);
          EXPECT_EQ(landmark.position_m, map_.landmarks()[static_cast<size_t>(there.landmark)].position_m);
          EXPECT_EQ(here.position_px, there.position_px);
          landmarks.insert(landmark.id);
        }
      }
    }
    num_observations += part->observations().size();
  }
  EXPECT_EQ(num_observations, map_.observations().size());
  EXPECT_EQ(landmarks.size(), map_.landmarks().size());
  EXPECT_THROW(reader->readTile({1000, 1000}), std::out_of_range);
}

TEST_F(MapTileTest, GivesRowsOfTheIndex) {
  const auto reader = MapTileReader::open(path_);
  EXPECT_EQ(reader->readPlaceRow(3), (std::vector<uint8_t>{1, 2, 3}));
  EXPECT_TRUE(reader->readPlaceRow(70).empty());
  EXPECT_TRUE(reader->readPlaceRow(4).empty());
}

TEST_F(MapTileTest, AFileWithoutAnIndexOfItsNewestVersionHasNoTiles) {
  EXPECT_EQ(readSparseMap(path_)->contentHash(), map_.contentHash());
  writeSparseMap(map_, {}, folder_ + "/plain.vmap");
  EXPECT_EQ(MapTileReader::open(folder_ + "/plain.vmap"), nullptr);
  EXPECT_EQ(MapTileReader::open(std::string(VCHARGE_TESTING_DATA) + "/schema_2.vmap"), nullptr);
  EXPECT_THROW(MapTileReader::open(folder_ + "/missing.vmap"), InputError);
  runSql("UPDATE index_info SET value = 'of another map' WHERE key = 'map_hash'");
  EXPECT_EQ(MapTileReader::open(path_), nullptr);
}

TEST_F(MapTileTest, AReaderGoesOnWithItsVersion) {
  SparseMapContents contents = map_.contents();
  contents.landmarks[0].position_m.x() += 0.5;
  const SparseMap changed(contents);
  const auto reader = MapTileReader::open(path_);
  {
    MapFileLock lock(path_);
    addMapVersion(changed, {}, 2, &lock, index_);
  }
  const auto hashOf = [](const SparseMap& map, const MapTileReader& tiles, const MapTile& tile) {
    return partOf(map, tiles.tiles().at(tile))->contentHash();
  };
  const auto newer = MapTileReader::open(path_);
  for (const auto& [tile, keyframes] : reader->tiles()) {
    EXPECT_EQ(reader->readTile(tile)->contentHash(), hashOf(map_, *reader, tile));
    EXPECT_EQ(newer->readTile(tile)->contentHash(), hashOf(changed, *newer, tile));
  }
  MapFileLock lock(path_);
  addMapVersion(changed, {}, 2, &lock);
  EXPECT_EQ(MapTileReader::open(path_), nullptr) << "a version without an index";
}

TEST_F(MapTileTest, NamesWhatIsDamaged) {
  ASSERT_EQ(errorOfTiles(), "");
  runSql("UPDATE meta SET value = value || 'x' WHERE key = 'feature_options'");
  EXPECT_THAT(errorOfTiles(), HasSubstr("its overview does not match the written hash"));
  runSql("UPDATE meta SET value = rtrim(value, 'x') WHERE key = 'feature_options'");
  runSql("UPDATE landmark SET x_m = x_m + 1 WHERE id = 5");
  EXPECT_THAT(errorOfTiles(), HasSubstr("the tile at"));
  EXPECT_THAT(errorOfTiles(), HasSubstr("does not match the written hash"));
  runSql("DELETE FROM landmark WHERE id = 5");
  EXPECT_THAT(errorOfTiles(), HasSubstr("there is no landmark 5"));
}

// A changed byte is reported, or has no meaning for tiles.
TEST_F(MapTileTest, NoChangedByteGivesAnotherTile) {
  std::vector<std::string> expected;
  for (const auto& [tile, keyframes] : tilesOf(map_.keyframes())) {
    expected.push_back(partOf(map_, keyframes)->contentHash());
  }
  const std::string bytes = readTextFile(path_);
  for (size_t at = 100; at < bytes.size(); at += 2003) {
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ 0x41);
    writeTextFileAtomically(path_, changed);
    try {
      const auto reader = MapTileReader::open(path_);
      if (reader == nullptr) {
        continue;
      }
      std::vector<std::string> found;
      for (const auto& [tile, keyframes] : reader->tiles()) {
        found.push_back(reader->readTile(tile)->contentHash());
      }
      EXPECT_EQ(found, expected) << at;
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace vcharge
