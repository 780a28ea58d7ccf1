/* test_ocean_ooi_contract.c - the contract of drivers, held by ocean_ooi. */
#include "drivers/ocean_ooi/ocean_ooi.h"
#include "tests/drivers/contract.h"
#include "tests/support/ocean_bench.h"
#include "unity.h"

static struct ocean_bench ocean;

static const char *set_up(enum contract_situation situation)
{
    /* A lamp so weak that white takes 200 ms, and a reading three times that. */
    const char *options =
        situation == CONTRACT_TAKES_TIME ? "under=black,lamp=0.08,noise=0" : "under=black,delays=0";
    ocean_bench_make(&ocean, &sim_usb2000, options);
    ocean.hands = true;
    if (situation == CONTRACT_SILENT)
        (void)wire_memory_act(ocean.memory, "fault mute");
    if (situation == CONTRACT_FALLS_SILENT)
        ocean.silent_measure = 2;
    return ocean_bench_address();
}

static void tear_down(void)
{
    ocean_bench_free(&ocean);
    ocean_bench_clean();
}

static const struct link_source *wire_source(void)
{
    return &ocean.source;
}

static const struct contract_fixture fixtures[] = {
    { .driver = &ocean_ooi_driver,
      .set_up = set_up,
      .tear_down = tear_down,
      .wire = wire_source,
      .deterministic = true },
};

void setUp(void)
{
    contract_set_up();
}

void tearDown(void)
{
    contract_tear_down();
}

int main(void)
{
    return contract_main(fixtures, sizeof fixtures / sizeof *fixtures);
}
