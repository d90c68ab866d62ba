#pragma once

#include <string>

#include "vcharge_core/dense_maps/parking_bay.h"

namespace vcharge {

/// Where the origin of a map lies on the WGS84 ellipsoid. Its x axis points east, its y axis north.
struct MapDatum {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
};

/// Writes bays as a map of Lanelet2 (OSM XML): each bay is an area of the subtype `parking` whose outer
/// bound, clockwise as Lanelet2 wants it, are a line around its closed sides and a `virtual` line across its
/// entry. What else is known of a bay is in tags of the area. Positions are exact to a micrometre if they are
/// read with the same datum; they are true to 0.1 m within 1 km of it. InputError if the file cannot be
/// written, or for a datum that is not on the earth or within a degree of a pole.
void writeBayLanelets(const ParkingBays& bays, const MapDatum& datum, const std::string& path);

/// Reads the areas of the subtype `parking` of a map of Lanelet2. Areas that others have drawn need four
/// corners and a `virtual` line across their entry; tags that they lack are: the area's number, one row,
/// perpendicular, unknown, no sigmas, confidence 1. Everything else in the file is skipped. InputError that
/// names file and area.
ParkingBays readBayLanelets(const std::string& path, const MapDatum& datum);

}  // namespace vcharge
