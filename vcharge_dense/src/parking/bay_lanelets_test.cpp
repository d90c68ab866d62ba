#include "vcharge_dense/bay_lanelets.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

class BayLaneletsTest : public ::testing::Test {
 protected:
  BayLaneletsTest() {
    std::string pattern = (std::filesystem::temp_directory_path() / "bay_lanelets_XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    ParkingBay bay;
    bay.id = 17;
    bay.row = 3;
    bay.kind = BayKind::kAngled;
    bay.state = BayState::kOccupied;
    bay.corners_m = {Eigen::Vector2d{10.25, -3.5}, {12.75, -3.25}, {14.0, 1.5}, {11.5, 1.25}};
    bay.entry_sigma_m = 0.05;
    bay.end_sigma_m = 0.4;
    bay.confidence = 0.75;
    bays_.bays = {bay, bay};
    bays_.bays[1].id = 18;
    bays_.bays[1].kind = BayKind::kParallel;
    bays_.bays[1].state = BayState::kUnknown;
  }
  ~BayLaneletsTest() override { std::filesystem::remove_all(folder_); }

  std::string path() const { return folder_ + "/bays.osm"; }
  std::string errorOf(const std::string& text) const {
    writeTextFileAtomically(path(), text);
    try {
      readBayLanelets(path(), datum_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  std::string folder_;
  ParkingBays bays_;
  const MapDatum datum_{48.4259, 10.8753};
};

TEST_F(BayLaneletsTest, ReadsWhatItWrites) {
  writeBayLanelets(bays_, datum_, path());
  const ParkingBays read = readBayLanelets(path(), datum_);
  ASSERT_EQ(read.bays.size(), 2U);
  for (size_t i = 0; i < 2; ++i) {
    const ParkingBay &bay = read.bays[i], &written = bays_.bays[i];
    EXPECT_EQ(bay.id, written.id);
    EXPECT_EQ(bay.row, written.row);
    EXPECT_EQ(bay.kind, written.kind);
    EXPECT_EQ(bay.state, written.state);
    EXPECT_EQ(bay.entry_sigma_m, written.entry_sigma_m);
    EXPECT_EQ(bay.end_sigma_m, written.end_sigma_m);
    EXPECT_EQ(bay.confidence, written.confidence);
    for (size_t corner = 0; corner < 4; ++corner) {
      EXPECT_LT((bay.corners_m[corner] - written.corners_m[corner]).norm(), 1e-6);
    }
  }
  writeBayLanelets({}, datum_, path());
  EXPECT_TRUE(readBayLanelets(path(), datum_).bays.empty());
}

TEST_F(BayLaneletsTest, PlacesBaysOnTheEarth) {
  // A minute of latitude at 45 degrees is 1852.2 m long, and at the equator 1842.9 m; one of longitude at the
  // equator 1855.3 m.
  ParkingBays bays;
  ParkingBay bay;
  bay.corners_m = {Eigen::Vector2d{0.0, 0.0}, {1855.325, 0.0}, {1855.325, 1842.905}, {0.0, 1842.905}};
  bays.bays.push_back(bay);
  writeBayLanelets(bays, {0.0, 0.0}, path());
  const Eigen::Vector2d far_m = readBayLanelets(path(), {0.0, -1.0 / 60.0}).bays[0].corners_m[2];
  EXPECT_NEAR(far_m.x(), 2.0 * 1855.325, 0.01);
  const std::string text = readTextFile(path());
  EXPECT_NE(text.find("lat=\"0.01666"), std::string::npos) << text;
  bay.corners_m[3] = bay.corners_m[2] = {0.0, 1852.19};
  bays.bays[0] = bay;
  writeBayLanelets(bays, {45.0, 0.0}, path());
  EXPECT_NE(readTextFile(path()).find("lat=\"45.016666"), std::string::npos) << readTextFile(path());
}

TEST_F(BayLaneletsTest, ReadsAreasThatOthersHaveDrawn) {
  const std::string nodes =
      "<osm version='0.6'><node id='-1' lat='0' lon='0'/><node id='-2' lat='0' lon='0.00002'/>"
      "<node id='-3' lat='0.00004' lon='0.00002'/><node id='-4' lat='0.00004' lon='0'/>"
      "<node id='-5' lat='1' lon='1'/>";
  const std::string tags = "<tag k='type' v='multipolygon'/><tag k='subtype' v='parking'/>";
  const std::string area =
      nodes +
      "<way id='-8'><nd ref='-1'/><nd ref='-4'/></way><way id='-9'><nd ref='-3'/><nd ref='-4'/></way>"
      "<way id='-10'><nd ref='-2'/><nd ref='-3'/></way>"
      "<way id='-11'><nd ref='-2'/><nd ref='-1'/><tag k='type' v='virtual'/></way>"
      "<relation id='4'><member type='way' ref='-8' role='outer'/><member type='way' ref='-9' role='outer'/>"
      "<member type='way' ref='-10' role='outer'/><member type='way' ref='-11' role='outer'/>" +
      tags + "</relation><relation id='5'><tag k='type' v='lanelet'/></relation></osm>";
  EXPECT_EQ(errorOf(area), "");
  const ParkingBays bays = readBayLanelets(path(), {0.0, 0.0});
  ASSERT_EQ(bays.bays.size(), 1U);
  EXPECT_EQ(bays.bays[0].id, 4U);
  EXPECT_EQ(bays.bays[0].state, BayState::kUnknown);
  EXPECT_NEAR(bays.bays[0].corners_m[0].x(), 0.0, 1e-9);
  EXPECT_NEAR(bays.bays[0].corners_m[1].x(), 2.226, 1e-3);
  EXPECT_NEAR(bays.bays[0].corners_m[2].y(), 4.423, 1e-3);
  EXPECT_NEAR(bays.bays[0].corners_m[3].x(), 0.0, 1e-9);
}

TEST_F(BayLaneletsTest, RefusesWhatIsNoMapOfBays) {
  EXPECT_THROW(readBayLanelets(folder_ + "/none.osm", datum_), InputError);
  EXPECT_NE(errorOf("bays: []"), "");
  EXPECT_NE(errorOf("<svg/>").find("<osm>"), std::string::npos);
  const std::string tags = "<tag k='type' v='multipolygon'/><tag k='subtype' v='parking'/>";
  EXPECT_NE(errorOf("<osm><relation id='7'>" + tags + "</relation></osm>").find("area 7"), std::string::npos);
  EXPECT_NE(errorOf("<osm><relation id='7'><member type='way' ref='1'/>" + tags + "</relation></osm>")
                .find("ways that it refers to"),
            std::string::npos);
  writeBayLanelets(bays_, datum_, path());
  std::string text = readTextFile(path());
  text.replace(text.find("angled"), 6, "square");
  EXPECT_NE(errorOf(text).find("tag kind"), std::string::npos);
  EXPECT_THROW(writeBayLanelets(bays_, {90.0, 0.0}, path()), InputError);
}

}  // namespace
}  // namespace vcharge
