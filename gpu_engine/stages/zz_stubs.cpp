#include "../host_stage.h"
namespace btgpu {
namespace {
class None : public HostStage {
 public:
  using HostStage::HostStage;
  void compute(StageIo&) override {}
  void store(StageIo&) override {}
  void check(StageIo&, Contract&) override {}
};
}
std::unique_ptr<HostStage> hostCollidePrimitives() { return std::make_unique<None>("-"); }
std::unique_ptr<HostStage> hostFindSeparatingAxis() { return std::make_unique<None>("-"); }
std::unique_ptr<HostStage> hostClipFaces() { return std::make_unique<None>("-"); }
std::unique_ptr<HostStage> hostFindClosestFeatures() { return std::make_unique<None>("-"); }
std::unique_ptr<HostStage> hostClipConvexFaces() { return std::make_unique<None>("-"); }
std::unique_ptr<HostStage> hostReduceAndMatchContacts() { return std::make_unique<None>("-"); }
}
