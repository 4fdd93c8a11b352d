// A picture that loads has as many samples as its header says; its notes are read or refused.
#include "io/picture_notes.h"
#include "io/png.h"
#include "memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const lensd::fuzz::MemoryFile file(data, size);
  const auto image = lensd::io::ReadPng(file.path());
  if (image && image->samples.size() != std::size_t(image->width) * image->height * image->channels) __builtin_trap();
  const auto notes = lensd::io::ReadOwnNotes(file.path());
  if (notes && notes->size() > size) __builtin_trap();
  return 0;
}
