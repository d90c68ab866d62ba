#include "vcharge_camera_driver/can_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <sys/socket.h>

#include <chrono>
#include <cstring>
#include <random>
#include <thread>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;

CanWheelOptions wheels() {
  CanWheelOptions options;
  options.left_ticks.id = options.right_ticks.id = 0x1a0;
  options.left_ticks.length = options.right_ticks.length = 16;
  options.right_ticks.start_bit = 16;
  return options;
}

// A bus whose other end belongs to the test; each open() of the reader creates a new one.
class Bus {
 public:
  CanReader::Open opener() {
    return [this] {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!there_) {
        throw InputError("can0: is not a CAN interface");
      }
      int ends[2];
      check(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) == 0, "no socket pair");
      hardware_ = FileDescriptor(ends[1]);
      return FileDescriptor(ends[0]);
    };
  }
  void send(const void* data, size_t size) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (hardware_) {
      ASSERT_EQ(::send(hardware_.get(), data, size, MSG_NOSIGNAL), static_cast<ssize_t>(size));
    }
  }
  void send(const can_frame& frame) { send(&frame, sizeof(frame)); }
  void sendTicks(uint16_t left, uint16_t right) {
    can_frame frame{};
    frame.can_id = 0x1a0;
    frame.can_dlc = 4;
    std::memcpy(frame.data, &left, 2);
    std::memcpy(frame.data + 2, &right, 2);
    send(frame);
  }
  void setThere(bool there) {
    const std::lock_guard<std::mutex> lock(mutex_);
    there_ = there;
    if (!there) {
      hardware_.reset();
    }
  }

 private:
  std::mutex mutex_;
  bool there_ = true;
  FileDescriptor hardware_;
};

class CanReaderTest : public ::testing::Test {
 protected:
  ~CanReaderTest() override {
    reader_.stop();
    thread_.join();
  }
  void waitFor(const std::function<bool()>& condition, const char* what) {
    for (int i = 0; i < 6000; ++i) {
      if (condition()) {
        return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    FAIL() << "timed out waiting for " << what;
  }
  std::vector<WheelTicks> received() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return received_;
  }

  Bus bus_;
  std::mutex mutex_;
  std::vector<WheelTicks> received_;
  CanReader reader_{bus_.opener(), wheels(), systemNow, 0.2};
  std::thread thread_{[this] {
    reader_.run([this](const WheelMeasurement& wheels) {
      const std::lock_guard<std::mutex> lock(mutex_);
      received_.push_back(std::get<WheelTicks>(wheels));
    });
  }};
};

TEST_F(CanReaderTest, ReadsTheTicksOfABus) {
  waitFor([&] { return reader_.status().connected; }, "the bus");
  for (int i = 0; i < 100; ++i) {
    bus_.sendTicks(static_cast<uint16_t>(65500 + i), static_cast<uint16_t>(i));
  }
  waitFor([&] { return received().size() == 100; }, "all ticks");
  EXPECT_EQ(received().back().left_ticks, 99);
  EXPECT_EQ(reader_.status().decoded.wraps, 1u);
  EXPECT_LT(std::abs(toSeconds(systemNow() - received().back().stamp)), 10.0);
}

TEST_F(CanReaderTest, TellsSilenceAndBusOffAndRecovers) {
  waitFor([&] { return reader_.status().connected; }, "the bus");
  bus_.sendTicks(1, 1);
  waitFor([&] { return received().size() == 1; }, "ticks");
  waitFor([&] { return reader_.status().silent; }, "the silence");
  can_frame error{};
  error.can_id = CAN_ERR_FLAG | CAN_ERR_BUSOFF;
  error.can_dlc = CAN_ERR_DLC;
  bus_.send(error);
  waitFor([&] { return reader_.status().bus_off; }, "bus-off");
  EXPECT_THAT(reader_.status().message, HasSubstr("bus-off"));
  bus_.sendTicks(2, 2);
  waitFor([&] { return received().size() == 2; }, "ticks");
  EXPECT_FALSE(reader_.status().bus_off);
  EXPECT_FALSE(reader_.status().silent);
}

TEST_F(CanReaderTest, OpensABusAnewThatWasGone) {
  waitFor([&] { return reader_.status().connected; }, "the bus");
  bus_.sendTicks(10, 10);
  waitFor([&] { return received().size() == 1; }, "ticks");
  bus_.setThere(false);
  waitFor([&] { return reader_.status().message == "can0: is not a CAN interface"; }, "its end");
  bus_.setThere(true);
  waitFor([&] { return reader_.status().connected; }, "the bus again");
  bus_.sendTicks(13, 13);
  waitFor([&] { return received().size() == 2; }, "ticks");
  EXPECT_EQ(received().back().left_ticks, 3) << "the counters went on";
  EXPECT_EQ(reader_.status().connections, 2u);
}

TEST_F(CanReaderTest, FuzzedDataNeverCrashesIt) {
  waitFor([&] { return reader_.status().connected; }, "the bus");
  std::mt19937 random(17);
  for (int i = 0; i < 10000; ++i) {
    uint8_t bytes[80];
    for (uint8_t& byte : bytes) {
      byte = static_cast<uint8_t>(random());
    }
    if (random() % 2 == 0) {
      const canid_t id = 0x1a0;
      std::memcpy(bytes, &id, sizeof(id));
    }
    bus_.send(bytes, random() % 4 == 0 ? 1 + random() % sizeof(bytes) : sizeof(can_frame));
  }
  waitFor([&] { return reader_.status().decoded.frames > 10 && reader_.status().bad_frames > 1000; },
          "the fuzz");
  // Frames that are still in the socket precede these; a random counter may have caused a reset.
  const size_t before = received().size();
  bus_.sendTicks(1, 1);
  bus_.sendTicks(2, 2);
  waitFor([&] { return received().size() >= before + 2; }, "ticks after the fuzz");
}

TEST(CanSocketTest, NamesTheInterfaceThatIsNotThere) {
  EXPECT_THAT([] { openCanSocket("can99"); },
              ::testing::ThrowsMessage<InputError>(::testing::StartsWith("can99: ")));
  EXPECT_THAT([] { openCanSocket(std::string(100, 'x')); },
              ::testing::ThrowsMessage<InputError>(HasSubstr("xxx: ")));
}

}  // namespace
}  // namespace vcharge
