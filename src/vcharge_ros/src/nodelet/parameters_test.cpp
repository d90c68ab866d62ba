#include "vcharge_ros/parameters.h"

#include <cmath>
#include <limits>

#include "vcharge_ros/live_drive_source.h"
#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

using testing::expectInputError;

TEST(ParametersTest, ReadsOptionsFromAParameterTree) {
  XmlRpc::XmlRpcValue value;
  value["topics"]["odometry"] = std::string("/wheel_odometry");
  value["cameras"][0] = std::string("left");
  value["cameras"][1] = std::string("front");
  value["image_transport"] = std::string("compressed");
  value["image_queue_size"] = 17;
  value["sort_window_s"] = 0.1;  // not a sum of powers of two
  value["max_silence_s"] = 3;    // an integer where a number is expected
  LiveDriveSourceOptions options;
  readFields(toYaml(value, "parameter /depth/drive"), "parameter /depth/drive", &options);
  EXPECT_EQ(options.topics.odometry, "/wheel_odometry");
  EXPECT_EQ(options.topics.wheel_ticks, "/wheel_ticks");
  EXPECT_EQ(options.cameras, (std::vector<std::string>{"left", "front"}));
  EXPECT_EQ(options.image_transport, ImageTransport::kCompressed);
  EXPECT_EQ(options.image_queue_size, 17);
  EXPECT_EQ(options.sort_window_s, 0.1);
  EXPECT_EQ(options.max_silence_s, 3.0);
}

TEST(ParametersTest, NamesUnknownAndBadParameters) {
  LiveDriveSourceOptions options;
  XmlRpc::XmlRpcValue unknown;
  unknown["topics"]["odometri"] = std::string("/odom");
  expectInputError(
      [&] { readFields(toYaml(unknown, "parameter /depth/drive"), "parameter /depth/drive", &options); },
      {"parameter /depth/drive", "topics.odometri"});
  XmlRpc::XmlRpcValue bad;
  bad["sort_window_s"] = std::string("wide");
  expectInputError([&] { readFields(toYaml(bad, "p"), "p", &options); }, {"p", "sort_window_s", "wide"});
  XmlRpc::XmlRpcValue negative;
  negative["max_silence_s"] = -1.0;
  expectInputError([&] { readFields(toYaml(negative, "p"), "p", &options); },
                   {"p", "max_silence_s", "positive"});
}

TEST(ParametersTest, KeepsNumbersThatTextWouldRound) {
  for (const double number :
       {1.0 / 3.0, 1e-300, -1.7976931348623157e308, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(toYaml(XmlRpc::XmlRpcValue(number), "p").as<double>(), number);
  }
  EXPECT_TRUE(std::isnan(toYaml(XmlRpc::XmlRpcValue(std::nan("")), "p").as<double>()));
}

TEST(ParametersTest, NamesTheParameterOfATypeThatOptionsDoNotHave) {
  char bytes[] = {1, 2, 3};
  XmlRpc::XmlRpcValue value;
  value["mask"] = XmlRpc::XmlRpcValue(static_cast<void*>(bytes), 3);
  expectInputError([&] { toYaml(value, "parameter /depth/rig"); }, {"parameter /depth/rig/mask", "expected"});
}

}  // namespace
}  // namespace vcharge
