/* test_simulated_contract.c - the contract of drivers, held by simulated. */
#include "drivers/simulated/simulated.h"
#include "tests/drivers/contract.h"
#include "unity.h"

static const char *set_up(enum contract_situation situation)
{
    static const char *const address[CONTRACT_SITUATIONS] = {
        [CONTRACT_SOUND] = "speed=instant,stored=3",
        [CONTRACT_TAKES_TIME] = "shot_ms=1000,calibrate_ms=1000,charge_ms=100",
        [CONTRACT_FALLS_SILENT] = "speed=instant,fault=measure:2:silence",
        [CONTRACT_SILENT] = "speed=instant,fault=open:1:silence",
    };
    return address[situation];
}

static void tear_down(void)
{
}

static const struct contract_fixture fixtures[] = {
    { .driver = &simulated_driver,
      .set_up = set_up,
      .tear_down = tear_down,
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
