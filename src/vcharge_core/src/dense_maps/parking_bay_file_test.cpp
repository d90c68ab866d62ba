#include "vcharge_core/dense_maps/parking_bay_file.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

class ParkingBayFileTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "parking_bay_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path() const { return folder_ + "/bays.yaml"; }

  std::string errorOf(const std::string& text) {
    writeTextFileAtomically(path(), text);
    try {
      readParkingBays(path());
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  std::string folder_;
};

std::string hashOf(const ParkingBays& bays) {
  ContentHasher hasher;
  addToHash(bays, &hasher);
  return hasher.hex();
}

TEST_F(ParkingBayFileTest, ReadsWhatItWrote) {
  ParkingBays bays;
  bays.frame_id = "world";
  for (const BayKind kind : {BayKind::kPerpendicular, BayKind::kAngled, BayKind::kParallel}) {
    ParkingBay bay;
    bay.id = static_cast<uint32_t>(kind) + 1;
    bay.row = 2;
    bay.kind = kind;
    bay.state = static_cast<BayState>(kind);
    bay.corners_m = {{{-1.25, 0.5}, {1.25, 0.5}, {1.25, 5.5}, {-1.25, 5.5}}};
    bay.entry_sigma_m = 0.05;
    bay.end_sigma_m = 0.25;
    bay.confidence = 0.75;
    bays.bays.push_back(bay);
  }
  writeParkingBays(bays, path());
  const ParkingBays read = readParkingBays(path());
  EXPECT_EQ(read.frame_id, "world");
  EXPECT_EQ(read.bays.size(), 3U);
  EXPECT_EQ(hashOf(read), hashOf(bays));
}

TEST_F(ParkingBayFileTest, ReadsAFileWithoutBays) {
  writeParkingBays(ParkingBays(), path());
  EXPECT_TRUE(readParkingBays(path()).bays.empty());
}

TEST_F(ParkingBayFileTest, NamesFileAndKeyOfWhatIsWrong) {
  const std::string begin = "frame: map\nbays:\n  - {id: 1, row: 0, kind: angled, state: free, ";
  const std::string corners = "corners_m: [[0, 0], [1, 0], [1, 1], [0, 1]], ";
  const std::string end = "entry_sigma_m: 0.1, end_sigma_m: 0.1, confidence: 0.5}\n";
  EXPECT_EQ(errorOf(begin + corners + end), "");
  EXPECT_NE(errorOf("bays: 3\n").find(path() + ": expected parking bays"), std::string::npos);
  EXPECT_NE(errorOf("frame: map\nbays: [3]\n").find("bays[0]: expected a bay"), std::string::npos);
  EXPECT_NE(errorOf(begin + "corners_m: [[0, 0], [1, 0]], " + end).find("bays[0].corners_m: expected four"),
            std::string::npos);
  EXPECT_NE(errorOf(begin + "corners_m: [[0, .nan], [1, 0], [1, 1], [0, 1]], " + end).find("corners_m"),
            std::string::npos);
  EXPECT_NE(
      errorOf(begin + corners + "entry_sigma_m: -1, end_sigma_m: 0, confidence: 1}\n").find("entry_sigma_m"),
      std::string::npos);
  EXPECT_NE(
      errorOf(begin + corners + "entry_sigma_m: 0, end_sigma_m: 0, confidence: 2}\n").find("confidence"),
      std::string::npos);
  std::string other = begin + corners + end;
  other.replace(other.find("angled"), 6, "round");
  EXPECT_NE(errorOf(other).find("expected one of perpendicular, angled, parallel, got 'round'"),
            std::string::npos);
  EXPECT_THROW(readParkingBays(folder_ + "/none.yaml"), InputError);
}

}  // namespace
}  // namespace vcharge
