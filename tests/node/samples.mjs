// The sample garment, dressed in a small knit: the Khronos validator has nothing to say of it.
import { dress, expect, finish, make_fabric, make_yarn_fabric, path, run } from './workshop.mjs';
import { validate } from './validate.mjs';

const fabric = make_fabric();
for (const form of ['glb', 'gltf']) {
  const variants = ['--variant', 'red=#aa3322', '--variant', `knit again=${fabric}`];
  const report = await validate(dress('sweater', form, ...variants));
  console.log(`sweater.${form}: ${report.errors} errors, ${report.warnings} warnings`);
  expect(report.errors + report.warnings === 0, 'no errors and no warnings', JSON.stringify(report.messages.slice(0, 8)));
}
const report = await validate(dress('sweater', 'glb', '--unwrap', 'always', '--backing', '#202020'));
expect(report.errors + report.warnings === 0, 'unwrapped and backed', JSON.stringify(report.messages.slice(0, 8)));
make_yarn_fabric();
dress('sweater', 'glb');
run('selvedge', 'export', path('sweater.glb'), '-o', path('yarn.glb'), '--quiet');
const exported = await validate(path('yarn.glb'));
expect(exported.errors + exported.warnings === 0, 'yarn', JSON.stringify(exported.messages.slice(0, 8)));
finish();
