#include "vcharge_evaluation/obstacle_truth.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

class TruthMoversTest : public ::testing::Test {
 protected:
  TruthMoversTest() {
    path_ = (std::filesystem::temp_directory_path() /
             (std::string("truth_movers_test_") +
              ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".yaml"))
                .string();
  }
  ~TruthMoversTest() override { std::filesystem::remove(path_); }

  // Reads the file after a text in it was replaced.
  std::map<Timestamp, std::vector<TruthMover>> read(const std::string& from = "",
                                                    const std::string& to = "") {
    std::string text =
        "frame: world\nimages:\n  - stamp_ns: 1342626148354042001\n    movers: []\n"
        "  - stamp_ns: 1342626148434042001\n    movers:\n"
        "      - {name: bicycle_1, kind: bicycle, base_z_m: 0.5, top_z_m: 2.25,\n"
        "         footprint_m: [[1, 2], [3, 2], [3, 2.5], [1, 2.5]], translation_m: [2, 2.25, 0.5],\n"
        "         rotation_xyzw: [0, 0, 1, 0], class: bicycle, velocity_m_per_s: [-4, 0.5, 0],\n"
        "         height_m: 1.75, is_standing: false}\n"
        "      - {name: adult_1, kind: pedestrian, base_z_m: 0, top_z_m: 1.7,\n"
        "         footprint_m: [[7, 2], [7.5, 2], [7, 2.5]], translation_m: [7.2, 2.2, 0],\n"
        "         rotation_xyzw: [0, 0, 0, 1], class: adult, velocity_m_per_s: [0, 0, 0],\n"
        "         height_m: 1.7, is_standing: true}\n";
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    writeTextFileAtomically(path_, text.replace(at, from.size(), to));
    return readTruthMovers(path_);
  }

  std::string path_;
};

TEST_F(TruthMoversTest, MoversHaveAnOutlineAndAPose) {
  const auto movers = read();
  ASSERT_EQ(movers.size(), 2U);
  EXPECT_TRUE(movers.begin()->second.empty());
  const std::vector<TruthMover>& here = movers.at(Timestamp::fromNanoseconds(1342626148434042001));
  ASSERT_EQ(here.size(), 2U);
  EXPECT_EQ(here[0].obstacle.kind, "bicycle");
  EXPECT_EQ(here[0].obstacle.height_m(), 1.75);
  const TrackedObject& bicycle = here[0].object;
  EXPECT_EQ(bicycle.id, 1U);
  EXPECT_EQ(bicycle.object_class, ObjectClass::kBicycle);
  EXPECT_EQ(bicycle.frame_from_object.translation(), Eigen::Vector3d(2.0, 2.25, 0.5));
  EXPECT_NEAR(std::abs(yawOfRotation(bicycle.frame_from_object.rotation())), M_PI, 1e-12);
  EXPECT_EQ(bicycle.velocity_m_per_s, Eigen::Vector3d(-4.0, 0.5, 0.0));
  EXPECT_EQ(bicycle.footprint_m.size(), 4U);
  EXPECT_EQ(bicycle.base_z_m, 0.5);
  EXPECT_FALSE(bicycle.is_standing);
  EXPECT_EQ(here[1].object.id, 2U);
  EXPECT_EQ(here[1].object.object_class, ObjectClass::kAdult);
  EXPECT_TRUE(here[1].object.is_standing);
}

TEST_F(TruthMoversTest, WithoutAFileThereAreNone) {
  EXPECT_TRUE(readTruthMovers(path_).empty());
}

TEST_F(TruthMoversTest, ErrorsNameFileAndStamp) {
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"class: bicycle", "class: tram"},
      {"velocity_m_per_s: [-4, 0.5, 0]", "speed: 4"},
      {"rotation_xyzw: [0, 0, 1, 0]", "rotation_xyzw: [0, 0, 0, 0]"},
      {"is_standing: false", "is_standing: 7"},
      {"[3, 2], [3, 2.5], [1, 2.5]", "[3, 2]"},
      {"stamp_ns: 1342626148434042001", "stamp_ns: later"}};
  for (const auto& [from, to] : changes) {
    try {
      read(from, to);
      ADD_FAILURE() << "no error for " << to;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(path_ + ": images"));
      EXPECT_THAT(error.what(), ::testing::HasSubstr("rotation_xyzw")) << to;
      EXPECT_EQ(std::string(error.what()).find("1342626148434042001") == std::string::npos,
                to == "stamp_ns: later")
          << error.what();
    }
  }
}

}  // namespace
}  // namespace vcharge
