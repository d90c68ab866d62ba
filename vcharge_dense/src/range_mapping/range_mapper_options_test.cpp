#include <vector>

#include <gtest/gtest.h>

#include "vcharge_core/base/options.h"
#include "vcharge_dense/neighbour_selection.h"
#include "vcharge_dense/range_mapper.h"

namespace vcharge {
namespace {

TEST(NeighbourSelectionTest, TakesEqualStepsUpToTheLongestBaseline) {
  const std::vector<double> baselines_m = {1.2, 0.8, 0.7, 0.6, 0.41, 0.3, 0.19, 0.05};
  EXPECT_EQ(selectNeighbours(baselines_m, 4, 0.8), (std::vector<size_t>{1, 3, 4, 6}));
  EXPECT_EQ(selectNeighbours({0.05, 5.0}, 4, 0.8), (std::vector<size_t>{}));
}

TEST(RangeMapperOptionsTest, PresetComesBeforeOtherFields) {
  RangeMapperOptions options;
  readFields(YAML::Load("{plane_sweep: {num_planes: 50}, preset: fast}"), "test", &options);
  EXPECT_EQ(options.preset, RangePreset::kFast);
  EXPECT_EQ(options.plane_sweep.num_planes, 50);
  RangeMapperOptions fast;
  fast.usePreset(RangePreset::kFast);
  EXPECT_EQ(options.plane_sweep.num_ground_planes, fast.plane_sweep.num_ground_planes);
  EXPECT_LT(fast.plane_sweep.num_planes, RangeMapperOptions().plane_sweep.num_planes);
  fast.usePreset(RangePreset::kDefault);
  EXPECT_EQ(YAML::Dump(writeFields(fast)), YAML::Dump(writeFields(RangeMapperOptions())));
  EXPECT_THROW(readFields(YAML::Load("{preset: quick}"), "test", &options), InputError);
}

}  // namespace
}  // namespace vcharge
