#include "vcharge_ros/range_map_conversions.h"

#include <array>
#include <cmath>
#include <cstring>

#include <boost/make_shared.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/camera_info.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge {
namespace {

using PackedPoint = std::array<float, 4>;  // x, y, z, intensity

sensor_msgs::PointCloud2Ptr makeCloud(const std::vector<PackedPoint>& points, Timestamp stamp,
                                      const std::string& frame_id) {
  auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
  cloud->header.stamp = fromTimestamp(stamp);
  cloud->header.frame_id = frame_id;
  cloud->height = 1;
  cloud->width = static_cast<uint32_t>(points.size());
  cloud->point_step = sizeof(PackedPoint);
  cloud->row_step = cloud->point_step * cloud->width;
  cloud->is_bigendian = false;
  cloud->is_dense = true;
  const char* const names[] = {"x", "y", "z", "intensity"};
  for (uint32_t i = 0; i < 4; ++i) {
    sensor_msgs::PointField field;
    field.name = names[i];
    field.offset = i * sizeof(float);
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    cloud->fields.push_back(field);
  }
  cloud->data.resize(points.size() * sizeof(PackedPoint));
  if (!points.empty()) {
    std::memcpy(cloud->data.data(), points.data(), cloud->data.size());
  }
  return cloud;
}

}  // namespace

RangeMapConverter::RangeMapConverter(double field_of_view_rad) : field_of_view_rad_(field_of_view_rad) {}
RangeMapConverter::~RangeMapConverter() = default;

void RangeMapConverter::prepare(const RangeMap& map) {
  if (rays_ && rays_->size() == map.range_m.size() && camera_parameters_ == map.camera.parameters()) {
    return;
  }
  camera_parameters_ = map.camera.parameters();
  rays_ = std::make_unique<RayTable>(map.camera, map.range_m.size(), 2.0 * M_PI);
  camera_info_ = makeCameraInfo(map.camera, map.range_m.size(), field_of_view_rad_, map.frame_id);
}

RangeMapMessages RangeMapConverter::convert(const RangeMap& map, const cv::Mat& gray, bool with_points) {
  const cv::Size size = map.range_m.size();
  check(map.range_m.type() == CV_32FC1 && map.confidence.type() == CV_32FC1 &&
            map.confidence.size() == size && map.standard_deviation_m.type() == CV_32FC1 &&
            map.standard_deviation_m.size() == size,
        "RangeMapConverter: expected three CV_32FC1 images of one size");
  check(gray.empty() || (gray.type() == CV_8UC1 && gray.size() == size),
        "RangeMapConverter: expected a CV_8UC1 image of the map's size");
  prepare(map);

  RangeMapMessages messages;
  messages.range = toImageMessage(map.range_m, map.stamp, map.frame_id);
  messages.confidence = toImageMessage(map.confidence, map.stamp, map.frame_id);
  messages.standard_deviation = toImageMessage(map.standard_deviation_m, map.stamp, map.frame_id);
  if (!gray.empty()) {
    messages.reference = toImageMessage(gray, map.stamp, map.frame_id);
  }
  messages.camera_info = boost::make_shared<sensor_msgs::CameraInfo>(camera_info_);
  messages.camera_info->header.stamp = fromTimestamp(map.stamp);
  messages.camera_info->header.frame_id = map.frame_id;
  if (with_points) {
    messages.points = makePoints(map, gray);
  }
  return messages;
}

sensor_msgs::PointCloud2Ptr RangeMapConverter::makePoints(const RangeMap& map, const cv::Mat& gray) const {
  const cv::Size size = map.range_m.size();
  std::vector<PackedPoint> points;
  points.reserve(static_cast<size_t>(size.area()));
  for (int y = 0; y < size.height; ++y) {
    const float* range_m = map.range_m.ptr<float>(y);
    const float* confidence = map.confidence.ptr<float>(y);
    const uint8_t* gray_row = gray.empty() ? nullptr : gray.ptr<uint8_t>(y);
    for (int x = 0; x < size.width; ++x) {
      if (!std::isfinite(range_m[x]) || !rays_->valid(x, y)) {
        continue;
      }
      const Eigen::Vector3f point = range_m[x] * rays_->ray(x, y);
      const float intensity = gray_row ? static_cast<float>(gray_row[x]) : 255.0f * confidence[x];
      points.push_back({point.x(), point.y(), point.z(), intensity});
    }
  }
  return makeCloud(points, map.stamp, map.frame_id);
}

}  // namespace vcharge
