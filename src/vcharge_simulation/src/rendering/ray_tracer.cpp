#include "rendering/ray_tracer.h"

#include <limits>
#include <stdexcept>

#include <tbb/global_control.h>

namespace vcharge {

namespace {

RTCRay makeRay(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float min_distance_m,
               float max_distance_m) {
  RTCRay ray = {};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tnear = min_distance_m;
  ray.tfar = max_distance_m;
  ray.mask = 0xFFFFFFFFU;
  return ray;
}

}  // namespace

RayTracer::RayTracer(const TriangleMesh& mesh, unsigned geometry_id) {
  // A single build thread makes the hierarchy, and with it the choice between coincident surfaces,
  // independent of the machine. TBB limits the threads because Embree's own setting applies to the whole
  // process.
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  device_ = rtcNewDevice("set_affinity=0");
  if (device_ == nullptr) {
    throw std::runtime_error("RayTracer: Embree cannot create a device");
  }
  scene_ = rtcNewScene(device_);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.vertices.data(), 0,
                             sizeof(MeshVertex), mesh.vertices.size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                             sizeof(MeshTriangle), mesh.triangles.size());
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene_, geometry, geometry_id);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
    throw std::runtime_error("RayTracer: Embree could not build the scene");
  }
}

RayTracer::~RayTracer() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

Eigen::Vector3f RayTracer::Hit::normal(const TriangleMesh& mesh) const {
  const auto& vertices = mesh.triangles[triangle].vertices;
  return ((1.0F - u - v) * mesh.vertices[vertices[0]].normal + u * mesh.vertices[vertices[1]].normal +
          v * mesh.vertices[vertices[2]].normal)
      .normalized();
}

bool RayTracer::cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, Hit* hit,
                     float min_distance_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query = {};
  query.ray = makeRay(origin, direction, min_distance_m, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
    return false;
  }
  *hit = {query.ray.tfar, query.hit.primID, query.hit.u, query.hit.v};
  return true;
}

bool RayTracer::occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                         float max_distance_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = makeRay(origin, direction, 0.0F, max_distance_m);
  rtcOccluded1(scene_, &context, &ray);
  return ray.tfar < 0.0F;
}

}  // namespace vcharge
