/* library.c - the colour of a skin with libskinspec:
 *   cc library.c $(pkg-config --cflags --libs skinspec) && ./a.out 0.03 0.7 0.01 */
#include <skinspec.h>
#include <stdio.h>
#include <stdlib.h>

static struct chromophores skin_bands;
static struct xyz_weights light;

int main(int argc, char **argv)
{
    double scratch[MEDIUM_SCRATCH(31)], R[31], XYZ[3], Lab[3];
    if (argc != 4)
        return 2;
    struct tissue skin =
        tissue_of(strtod(argv[1], NULL), strtod(argv[2], NULL), strtod(argv[3], NULL));
    if (chromophores_init(400, 10, 31, &skin_bands) != STATUS_OK ||
        xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, 400, 10, 31, &light) != STATUS_OK ||
        model_reflectance(model_find("two-layer"), &skin, &skin_bands, scratch, R) != STATUS_OK)
        return 1;
    xyz_from_reflectance(&light, R, XYZ);
    lab_from_xyz(XYZ, light.white, Lab);
    printf("L* %.2f a* %.2f b* %.2f\n", Lab[0], Lab[1], Lab[2]);
}
