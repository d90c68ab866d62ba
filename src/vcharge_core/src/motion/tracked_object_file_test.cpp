#include "vcharge_core/motion/tracked_object_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;

TrackedObject objectAt(uint32_t id, double x_m, double y_m) {
  TrackedObject object;
  object.id = id;
  object.object_class = ObjectClass::kBicycle;
  object.class_probability = 1.0 / 3.0;
  object.existence_probability = 0.875;
  object.frame_from_object = RigidTransform::planar(x_m, y_m, 0.0);
  object.velocity_m_per_s = {-1.1, 0.2, 0.0};
  object.height_m = 1.7;
  // v v^T is positive semi-definite, and all of its entries differ.
  const Eigen::Vector4d v(0.1, -0.2, 0.3, 0.7);
  const std::vector<int> rows = {0, 1, 3, 4};
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      object.covariance(rows[i], rows[j]) = v[static_cast<int>(i)] * v[static_cast<int>(j)];
    }
  }
  object.footprint_m = {{x_m - 0.1, y_m - 0.2}, {x_m + 0.9, y_m - 0.2}, {x_m, y_m + 1e-7}};
  return object;
}

class TrackedObjectFileTest : public ::testing::Test {
 protected:
  TrackedObjectFileTest() {
    folder_ = (fs::temp_directory_path() /
               ("tracked_object_file_test_" +
                std::string(::testing::UnitTest::GetInstance()->current_test_info()->name())))
                  .string();
    fs::remove_all(folder_);
    frames_.resize(3);
    for (int i = 0; i < 3; ++i) {
      frames_[i].stamp = Timestamp::fromNanoseconds(1342626148354042001 + 80000000 * i);
      frames_[i].odom_from_vehicle = RigidTransform::planar(0.1 * i, -0.7, 0.0);
    }
    frames_[0].objects = {objectAt(7, 2.1, 0.3), objectAt(4000000000U, -3.4, 0.1)};
    frames_[2].objects = {objectAt(7, 2.0, 0.4)};
    frames_[2].objects[0].is_standing = true;
  }
  ~TrackedObjectFileTest() override { fs::remove_all(folder_); }

  static std::string hashOf(const std::vector<ObjectFrame>& frames) {
    ContentHasher hasher;
    for (const ObjectFrame& frame : frames) {
      addToHash(frame, &hasher);
    }
    return hasher.hex();
  }
  // The message of the error that reading throws after one text of a file was replaced; "" without one.
  std::string errorAfter(const std::string& file, const std::string& from, const std::string& to) {
    writeObjects(frames_, folder_);
    std::string text = readTextFile(folder_ + "/" + file);
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    std::ofstream(folder_ + "/" + file) << text.replace(at, from.size(), to);
    try {
      readObjects(folder_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  std::string folder_;
  std::vector<ObjectFrame> frames_;
};

TEST_F(TrackedObjectFileTest, ReadsWhatItWrote) {
  writeObjects(frames_, folder_);
  EXPECT_EQ(hashOf(readObjects(folder_)), hashOf(frames_));
  EXPECT_TRUE(readObjects(folder_)[1].objects.empty());
}

TEST_F(TrackedObjectFileTest, YawIsReadWithinRounding) {
  frames_[0].odom_from_vehicle = RigidTransform::planar(1.0, 2.0, -3.1);
  frames_[0].objects[0].frame_from_object = RigidTransform::planar(1.0, 2.0, M_PI);
  writeObjects(frames_, folder_);
  const std::vector<ObjectFrame> read = readObjects(folder_);
  EXPECT_NEAR(yawOfRotation(read[0].odom_from_vehicle.rotation()), -3.1, 1e-12);
  EXPECT_NEAR(std::abs(yawOfRotation(read[0].objects[0].frame_from_object.rotation())), M_PI, 1e-12);
}

TEST_F(TrackedObjectFileTest, DriveWithoutFramesOrObjects) {
  writeObjects({}, folder_);
  EXPECT_TRUE(readObjects(folder_).empty());
}

TEST_F(TrackedObjectFileTest, EqualFramesGiveEqualFiles) {
  writeObjects(frames_, folder_);
  const std::string first = readTextFile(folder_ + "/objects.csv");
  writeObjects(readObjects(folder_), folder_);
  EXPECT_EQ(readTextFile(folder_ + "/objects.csv"), first);
}

TEST_F(TrackedObjectFileTest, HashTellsEveryMemberApart) {
  const std::string before = hashOf(frames_);
  const std::vector<std::function<void(TrackedObject*)>> changes = {
      [](TrackedObject* object) { ++object->id; },
      [](TrackedObject* object) { object->object_class = ObjectClass::kCar; },
      [](TrackedObject* object) { object->class_probability = 0.5; },
      [](TrackedObject* object) { object->existence_probability = 0.5; },
      [](TrackedObject* object) { object->frame_from_object = RigidTransform::planar(0.0, 0.0, 0.1); },
      [](TrackedObject* object) { object->velocity_m_per_s.y() = 0.3; },
      [](TrackedObject* object) { object->is_standing = !object->is_standing; },
      [](TrackedObject* object) { object->covariance(1, 3) += 0.1; },
      [](TrackedObject* object) { object->footprint_m.pop_back(); },
      [](TrackedObject* object) { object->base_z_m = 0.1; },
      [](TrackedObject* object) { object->height_m = 0.1; }};
  for (size_t i = 0; i < changes.size(); ++i) {
    std::vector<ObjectFrame> changed = frames_;
    changes[i](&changed[0].objects[1]);
    EXPECT_NE(hashOf(changed), before) << i;
  }
  std::vector<ObjectFrame> moved = frames_;
  std::swap(moved[0].objects, moved[1].objects);
  EXPECT_NE(hashOf(moved), before);
}

TEST_F(TrackedObjectFileTest, ErrorsNameFileLineAndColumn) {
  const auto expectError = [&](const std::string& file, const std::string& from, const std::string& to,
                               const std::string& expected) {
    EXPECT_THAT(errorAfter(file, from, to), ::testing::HasSubstr(file + expected)) << to;
  };
  const std::string stamp = std::to_string(frames_[1].stamp.nanoseconds());
  expectError("objects_frames.csv", "x_m", "x", ":1: expected the header");
  expectError("objects_frames.csv", stamp, "1", ":3: stamp_ns: expected increasing stamps, got '1'");
  expectError("objects_frames.csv", stamp, stamp + "\r", ":3: stamp_ns: expected an integer");
  expectError("objects_frames.csv", stamp + ",", stamp + ",,", ":3: expected 5 columns, got 6");
  expectError("objects_frames.csv", stamp + ",0.1", stamp + ",nan", ":3: x_m: expected a finite number");
  expectError("objects_frames.csv", ",0\n", ",1\n", ":3: num_objects: expected the 0 of objects.csv, got 1");
  expectError("objects.csv", "7,bicycle", "-7,bicycle", ":2: id: expected an integer, got '-7'");
  expectError("objects.csv", "bicycle", "tram", ":2: class: expected unknown, adult, child, car or bicycle");
  expectError("objects.csv", "0.875", "1.5",
              ":2: existence_probability: expected a finite number from 0 to 1");
  expectError("objects.csv", "2.1,0.3", "2.1e999,0.3", ":2: x_m: expected a finite number");
  expectError("objects.csv", "0.2,0,1.7", "0.2,2,1.7", ":2: is_standing: expected 0 or 1, got '2'");
  expectError("objects.csv", ",1.7,", ",-1.7,", ":2: height_m: expected a finite number from 0 to inf");
  expectError("objects.csv", ",1.7,0", ",1.7,-0", ":2: cov_x_x_m2: expected a finite number from 0 to inf");
  expectError("objects.csv", ";3 ", ";3 4 ", ":2: footprint_m: expected corners");
  expectError("objects.csv", ";3 0.09999999999999998", "", ":2: footprint_m: expected three corners or more");
  expectError("objects.csv", ",4000000000", ",7", ":3: id: expected each id once at a stamp, got 7 twice");
  expectError("objects.csv", ",4000000000", ",5000000000", ":3: id: expected an integer");
  const std::string first = std::to_string(frames_[0].stamp.nanoseconds());
  expectError("objects.csv", first, "5", ":2: stamp_ns: expected a stamp of objects_frames.csv, got '5'");
}

TEST_F(TrackedObjectFileTest, MissingFilesAreNamed) {
  writeObjects(frames_, folder_);
  fs::remove(folder_ + "/objects.csv");
  EXPECT_THROW(readObjects(folder_), InputError);
  EXPECT_THROW(readObjects(folder_ + "/none"), InputError);
}

TEST_F(TrackedObjectFileTest, RefusesToWriteWhatItCouldNotRead) {
  std::vector<ObjectFrame> bad = frames_;
  bad[1].stamp = bad[0].stamp;
  EXPECT_THROW(writeObjects(bad, folder_), std::logic_error);
  bad = frames_;
  bad[0].objects[1].id = bad[0].objects[0].id;
  EXPECT_THROW(writeObjects(bad, folder_), std::logic_error);
  bad = frames_;
  bad[0].objects[0].velocity_m_per_s.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(writeObjects(bad, folder_), std::logic_error);
  bad = frames_;
  bad[0].objects[0].footprint_m.pop_back();
  EXPECT_THROW(writeObjects(bad, folder_), std::logic_error);
  EXPECT_FALSE(fs::exists(folder_));
}

TEST(ObjectClassTest, NamesAreReadBack) {
  for (const ObjectClass each : {ObjectClass::kUnknown, ObjectClass::kAdult, ObjectClass::kChild,
                                 ObjectClass::kCar, ObjectClass::kBicycle}) {
    EXPECT_EQ(objectClassOf(nameOf(each)), each);
  }
  EXPECT_FALSE(objectClassOf("Car"));
}

}  // namespace
}  // namespace vcharge
