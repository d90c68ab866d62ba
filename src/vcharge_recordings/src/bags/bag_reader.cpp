#include "vcharge_recordings/bag_reader.h"

#include <algorithm>
#include <tuple>

#include <std_msgs/Header.h>

#include "bags/bag_decompression.h"
#include "bags/bag_records.h"

namespace vcharge {

using internal::BagFields;
using internal::BagRecord;
using internal::readBagRecord;
using Kind = internal::BagRecordKind;

namespace internal {
namespace {

void requireArray(ros::serialization::IStream* stream) {
  uint32_t size = 0;
  stream->next(size);
  stream->advance(size);
}

}  // namespace

template <>
void requireWholeArrays<sensor_msgs::Image>(ros::serialization::IStream stream) {
  std_msgs::Header header;
  stream.next(header);
  stream.advance(8);      // height and width
  requireArray(&stream);  // encoding
  stream.advance(5);      // byte order and step
  requireArray(&stream);
}

template <>
void requireWholeArrays<sensor_msgs::CompressedImage>(ros::serialization::IStream stream) {
  std_msgs::Header header;
  stream.next(header);
  requireArray(&stream);  // format
  requireArray(&stream);
}

}  // namespace internal

namespace {

constexpr std::string_view kVersion = "#ROSBAG V2.0\n";
constexpr uint32_t kIndexEntrySize = 12, kChunkInfoEntrySize = 8;

}  // namespace

BagReader::BagReader(std::string path)
    : path_(std::move(path)), file_(std::make_unique<internal::BagFile>(path_)) {
  readVersion();
  readIndex();
  std::sort(entries_.begin(), entries_.end(), [](const BagEntry& a, const BagEntry& b) {
    return std::tie(a.time, a.chunk, a.offset) < std::tie(b.time, b.chunk, b.offset);
  });
  for (const BagEntry& entry : entries_) {
    topics_[topicOf(entry)].insert(connections_[entry.connection].type);
  }
}

BagReader::~BagReader() = default;

void BagReader::readVersion() const {
  if (file_->size() < kVersion.size() || file_->view(0, kVersion.size()) != kVersion) {
    throw InputError(path_ + ": expected a ROS bag of format 2.0, which begins with '#ROSBAG V2.0'");
  }
}

// The file's header has the position of the index: one record per connection and per chunk.
void BagReader::readIndex() {
  const BagRecord header = readBagRecord(file_.get(), kVersion.size(), file_->size(), Kind::kFileHeader);
  const auto index_offset = header.fields.number<uint64_t>("index_pos");
  if (index_offset == 0) {
    throw InputError(path_ +
                     ": the bag has no index (was its recording cut off?); expected a complete bag, see "
                     "`rosbag reindex`");
  }
  if (header.fields.has("encryptor") && header.fields.text("encryptor") != "rosbag/NoEncryptor" &&
      !header.fields.text("encryptor").empty()) {
    throw InputError(path_ + ": expected a bag without encryption, got one by '" +
                     header.fields.text("encryptor") + "', see `rosbag decrypt`");
  }
  if (index_offset < header.end() || index_offset > file_->size()) {
    file_->fail(kVersion.size(), "the index's position after the file's header and within the file, got " +
                                     std::to_string(index_offset));
  }
  uint64_t offset = index_offset;
  for (auto i = header.fields.number<uint32_t>("conn_count"); i > 0; --i) {
    offset = readConnection(offset);
  }
  for (auto i = header.fields.number<uint32_t>("chunk_count"); i > 0; --i) {
    offset = readChunkInfo(offset, index_offset);
  }
}

uint64_t BagReader::readConnection(uint64_t offset) {
  const BagRecord record = readBagRecord(file_.get(), offset, file_->size(), Kind::kConnection);
  const BagFields definition(file_.get(), record.data_offset, record.data_size);
  const auto id = record.fields.number<uint32_t>("conn");
  if (connection_by_id_.emplace(id, static_cast<uint32_t>(connections_.size())).second) {
    connections_.push_back(
        {id, record.fields.text("topic"), definition.text("type"), definition.text("md5sum")});
  }
  return record.end();
}

uint32_t BagReader::connectionOf(uint32_t id, uint64_t offset) const {
  const auto found = connection_by_id_.find(id);
  if (found == connection_by_id_.end()) {
    file_->fail(offset, "a connection of the index, got connection " + std::to_string(id));
  }
  return found->second;
}

uint64_t BagReader::readChunkInfo(uint64_t offset, uint64_t index_offset) {
  const BagRecord record = readBagRecord(file_.get(), offset, file_->size(), Kind::kChunkInfo);
  const auto version = record.fields.number<uint32_t>("ver");
  const auto count = record.fields.number<uint32_t>("count");
  const auto chunk_offset = record.fields.number<uint64_t>("chunk_pos");
  if (version != 1 || record.data_size != uint64_t{count} * kChunkInfoEntrySize) {
    file_->fail(offset, "a chunk info of version 1 with " + std::to_string(kChunkInfoEntrySize) +
                            " bytes for each of its connections");
  }
  if (chunk_offset >= index_offset) {
    file_->fail(offset, "a chunk before the index at byte " + std::to_string(index_offset) + ", got byte " +
                            std::to_string(chunk_offset));
  }
  chunks_.push_back(readChunk(chunk_offset, index_offset));
  uint64_t next = chunks_.back().offset + chunks_.back().stored_size;
  for (uint32_t i = 0; i < count; ++i) {
    next = readChunkIndex(next, index_offset);
  }
  return record.end();
}

BagReader::Chunk BagReader::readChunk(uint64_t offset, uint64_t index_offset) const {
  const BagRecord record = readBagRecord(file_.get(), offset, index_offset, Kind::kChunk);
  Chunk chunk{record.data_offset, record.data_size, record.fields.number<uint32_t>("size"),
              record.fields.text("compression")};
  const bool plain = chunk.compression == "none";
  if (!plain && !internal::isChunkCompression(chunk.compression)) {
    file_->fail(offset, "a chunk with compression none, bz2 or lz4");
  }
  if (plain && chunk.size != chunk.stored_size) {
    file_->fail(offset, "a chunk of the size of its data (" + std::to_string(chunk.stored_size) + "), got " +
                            std::to_string(chunk.size));
  }
  return chunk;
}

uint64_t BagReader::readChunkIndex(uint64_t offset, uint64_t index_offset) {
  const BagRecord record = readBagRecord(file_.get(), offset, index_offset, Kind::kIndex);
  const auto version = record.fields.number<uint32_t>("ver");
  const auto count = record.fields.number<uint32_t>("count");
  if (version != 1 || record.data_size != uint64_t{count} * kIndexEntrySize) {
    file_->fail(offset, "an index of version 1 with " + std::to_string(kIndexEntrySize) +
                            " bytes for each of its messages");
  }
  const uint32_t connection = connectionOf(record.fields.number<uint32_t>("conn"), offset);
  const auto chunk = static_cast<uint32_t>(chunks_.size() - 1);
  for (uint64_t at = record.data_offset; at < record.end(); at += kIndexEntrySize) {
    const auto sec = file_->number<uint32_t>(at);
    const auto nsec = file_->number<uint32_t>(at + 4);
    const auto message_offset = file_->number<uint32_t>(at + 8);
    if (nsec >= 1000000000 || message_offset >= chunks_.back().size) {
      file_->fail(at, "a time and the offset of a message in a chunk of " +
                          std::to_string(chunks_.back().size) + " bytes");
    }
    if (sec > 0 || nsec > 0) {  // rosbag, too, skips messages recorded before the clock started
      entries_.push_back({ros::Time(sec, nsec), connection, chunk, message_offset});
    }
  }
  return record.end();
}

std::vector<BagEntry> BagReader::entries(const std::set<std::string>& topics) const {
  std::vector<BagEntry> selected;
  std::copy_if(entries_.begin(), entries_.end(), std::back_inserter(selected),
               [&](const BagEntry& entry) { return topics.count(topicOf(entry)) > 0; });
  return selected;
}

internal::BagBytes* BagReader::decompressed(uint32_t index) {
  const Chunk& chunk = chunks_[index];
  if (decompressed_chunk_ != index) {
    decompressed_chunk_.reset();
    decompressed_.reset();
    const std::string name = path_ + ": chunk with data at byte " + std::to_string(chunk.offset);
    try {
      decompressed_ = std::make_unique<internal::BagChunkBytes>(
          name, internal::decompressChunk(chunk.compression, file_->view(chunk.offset, chunk.stored_size),
                                          chunk.size));
    } catch (const InputError& error) {
      throw InputError(name + ": corrupt: " + error.what());
    }
    decompressed_chunk_ = index;
  }
  return decompressed_.get();
}

BagMessage BagReader::read(const BagEntry& entry) {
  const Chunk& chunk = chunks_[entry.chunk];
  const Connection& connection = connections_[entry.connection];
  const bool plain = chunk.compression == "none";
  internal::BagBytes* const bytes = plain ? file_.get() : decompressed(entry.chunk);
  const uint64_t begin = plain ? chunk.offset : 0;
  const BagRecord record = readBagRecord(bytes, begin + entry.offset, begin + chunk.size, Kind::kMessage);
  if (record.fields.number<uint32_t>("conn") != connection.id) {
    bytes->fail(begin + entry.offset, "a message on " + connection.topic + ", as the index says");
  }
  return {path_ + ": " + connection.topic, connection.md5sum,
          bytes->view(record.data_offset, record.data_size)};
}

}  // namespace vcharge
