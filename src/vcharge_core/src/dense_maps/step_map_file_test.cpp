#include "vcharge_core/dense_maps/step_map_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;

class StepMapFileTest : public ::testing::Test {
 protected:
  StepMapFileTest() {
    folder_ = (fs::temp_directory_path() /
               ("step_map_file_test_" +
                std::string(::testing::UnitTest::GetInstance()->current_test_info()->name())))
                  .string();
    fs::remove_all(folder_);
    map_ = StepMap::unknown({5, 3}, 0.05);
    map_.stamp = Timestamp::fromNanoseconds(1342626148354042001);
    map_.frame_id = "odom";
    map_.fixed_from_vehicle = RigidTransform::planar(1.25, -2.5, 0.3);
    map_.origin_m = {-7.1, 3.2};
    map_.ground_m.at<float>(0, 4) = 0.11F;
    map_.height_m.at<float>(0, 4) = 0.12F;
    map_.sigma_m.at<float>(0, 4) = 0.004F;
  }
  ~StepMapFileTest() override { fs::remove_all(folder_); }

  std::string stem() const { return folder_ + "/" + std::to_string(map_.stamp.nanoseconds()) + "_steps"; }

  std::string folder_;
  StepMap map_;
};

std::string hashOf(const StepMap& map) {
  ContentHasher hasher;
  addToHash(map, &hasher);
  return hasher.hex();
}

TEST_F(StepMapFileTest, ReadsWhatItWrote) {
  writeStepMap(map_, folder_);
  EXPECT_THAT(listStepMaps(folder_), testing::ElementsAre(map_.stamp));
  EXPECT_EQ(hashOf(readStepMap(folder_, map_.stamp)), hashOf(map_));
}

TEST_F(StepMapFileTest, EveryLayerCountsInTheHash) {
  for (cv::Mat* image : {&map_.ground_m, &map_.height_m, &map_.sigma_m}) {
    const std::string before = hashOf(map_);
    image->at<float>(2, 0) = 0.07F;
    EXPECT_NE(hashOf(map_), before);
  }
}

TEST_F(StepMapFileTest, NamesTheFileThatIsMissingOrBad) {
  EXPECT_THROW(listStepMaps(folder_), InputError);
  writeStepMap(map_, folder_);
  fs::remove(stem() + "_sigma.tiff");
  EXPECT_THAT([&] { readStepMap(folder_, map_.stamp); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("_steps_sigma.tiff")));
  std::ofstream(stem() + ".yaml") << "stamp_ns: 5\n";
  EXPECT_THAT([&] { readStepMap(folder_, map_.stamp); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("cell_size_m")));
}

}  // namespace
}  // namespace vcharge
