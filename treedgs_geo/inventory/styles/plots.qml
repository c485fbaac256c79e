<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.16-Białowieża" styleCategories="LayerConfiguration|Symbology|Labeling|Fields|Forms|MapTips|AttributeTable" labelsEnabled="0" readOnly="0">
  <flags>
    <Identifiable>1</Identifiable>
    <Removable>1</Removable>
    <Searchable>1</Searchable>
    <Private>0</Private>
  </flags>
  <renderer-v2 symbollevels="0" attr="status" enableorderby="0" type="categorizedSymbol" referencescale="-1" forceraster="0">
    <categories>
      <category symbol="0" render="true" label="placed" value="auto"/>
      <category symbol="1" render="true" label="confirmed by hand" value="ok"/>
      <category symbol="2" render="true" label="needs a hand check" value="check"/>
    </categories>
    <symbols>
      <symbol clip_to_extent="1" type="fill" name="0" force_rhr="0" alpha="1">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer locked="0" pass="0" class="SimpleFill" enabled="1">
          <Option type="Map">
            <Option type="QString" name="border_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="color" value="0,0,255,255"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="85,85,85,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.4"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="style" value="no"/>
          </Option>
          <prop v="3x:0,0,0,0,0,0" k="border_width_map_unit_scale"/>
          <prop v="0,0,255,255" k="color"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="0,0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="85,85,85,255" k="outline_color"/>
          <prop v="solid" k="outline_style"/>
          <prop v="0.4" k="outline_width"/>
          <prop v="MM" k="outline_width_unit"/>
          <prop v="no" k="style"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol clip_to_extent="1" type="fill" name="1" force_rhr="0" alpha="1">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer locked="0" pass="0" class="SimpleFill" enabled="1">
          <Option type="Map">
            <Option type="QString" name="border_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="color" value="0,0,255,255"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="46,139,61,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.6"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="style" value="no"/>
          </Option>
          <prop v="3x:0,0,0,0,0,0" k="border_width_map_unit_scale"/>
          <prop v="0,0,255,255" k="color"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="0,0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="46,139,61,255" k="outline_color"/>
          <prop v="solid" k="outline_style"/>
          <prop v="0.6" k="outline_width"/>
          <prop v="MM" k="outline_width_unit"/>
          <prop v="no" k="style"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol clip_to_extent="1" type="fill" name="2" force_rhr="0" alpha="1">
        <data_defined_properties>
          <Option type="Map">
            <Option type="QString" name="name" value=""/>
            <Option name="properties"/>
            <Option type="QString" name="type" value="collection"/>
          </Option>
        </data_defined_properties>
        <layer locked="0" pass="0" class="SimpleFill" enabled="1">
          <Option type="Map">
            <Option type="QString" name="border_width_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="color" value="0,0,255,255"/>
            <Option type="QString" name="joinstyle" value="bevel"/>
            <Option type="QString" name="offset" value="0,0"/>
            <Option type="QString" name="offset_map_unit_scale" value="3x:0,0,0,0,0,0"/>
            <Option type="QString" name="offset_unit" value="MM"/>
            <Option type="QString" name="outline_color" value="106,61,154,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.9"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="style" value="no"/>
          </Option>
          <prop v="3x:0,0,0,0,0,0" k="border_width_map_unit_scale"/>
          <prop v="0,0,255,255" k="color"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="0,0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="106,61,154,255" k="outline_color"/>
          <prop v="solid" k="outline_style"/>
          <prop v="0.9" k="outline_width"/>
          <prop v="MM" k="outline_width_unit"/>
          <prop v="no" k="style"/>
          <data_defined_properties>
            <Option type="Map">
              <Option type="QString" name="name" value=""/>
              <Option name="properties"/>
              <Option type="QString" name="type" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
    </symbols>
    <rotation/>
    <sizescale/>
  </renderer-v2>
  <blendMode>0</blendMode>
  <featureBlendMode>0</featureBlendMode>
  <fieldConfiguration>
    <field name="plot_id" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="status" configurationFlags="None">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option type="List" name="map">
              <Option type="Map">
                <Option type="QString" name="placed" value="auto"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="confirmed by hand" value="ok"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="needs a hand check" value="check"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="reason" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="offset_e_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="offset_n_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="rot_deg" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="ratio" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="margin" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="residual_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="share" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_field" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_measured" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_pairs" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="n_sugg" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="radius_m" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="x" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="y" configurationFlags="None">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" name="Plot" field="plot_id"/>
    <alias index="1" name="Status" field="status"/>
    <alias index="2" name="Reason" field="reason"/>
    <alias index="3" name="Moved east [m]" field="offset_e_m"/>
    <alias index="4" name="Moved north [m]" field="offset_n_m"/>
    <alias index="5" name="Turned clockwise [°]" field="rot_deg"/>
    <alias index="6" name="Score over the next best placing" field="ratio"/>
    <alias index="7" name="Log-likelihood over the next best placing" field="margin"/>
    <alias index="8" name="Residual of the pairs [m]" field="residual_m"/>
    <alias index="9" name="Share of trees with a partner within 1 m" field="share"/>
    <alias index="10" name="Field trees" field="n_field"/>
    <alias index="11" name="Measured trees in the circle" field="n_measured"/>
    <alias index="12" name="Pairs" field="n_pairs"/>
    <alias index="13" name="Suggestions" field="n_sugg"/>
    <alias index="14" name="Radius [m]" field="radius_m"/>
    <alias index="15" name="Easting of the centre, co-registered [m]" field="x"/>
    <alias index="16" name="Northing of the centre, co-registered [m]" field="y"/>
  </aliases>
  <defaults>
    <default expression="" applyOnUpdate="0" field="plot_id"/>
    <default expression="" applyOnUpdate="0" field="status"/>
    <default expression="" applyOnUpdate="0" field="reason"/>
    <default expression="" applyOnUpdate="0" field="offset_e_m"/>
    <default expression="" applyOnUpdate="0" field="offset_n_m"/>
    <default expression="" applyOnUpdate="0" field="rot_deg"/>
    <default expression="" applyOnUpdate="0" field="ratio"/>
    <default expression="" applyOnUpdate="0" field="margin"/>
    <default expression="" applyOnUpdate="0" field="residual_m"/>
    <default expression="" applyOnUpdate="0" field="share"/>
    <default expression="" applyOnUpdate="0" field="n_field"/>
    <default expression="" applyOnUpdate="0" field="n_measured"/>
    <default expression="" applyOnUpdate="0" field="n_pairs"/>
    <default expression="" applyOnUpdate="0" field="n_sugg"/>
    <default expression="" applyOnUpdate="0" field="radius_m"/>
    <default expression="" applyOnUpdate="0" field="x"/>
    <default expression="" applyOnUpdate="0" field="y"/>
  </defaults>
  <constraints>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="plot_id" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="status" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="reason" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="offset_e_m" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="offset_n_m" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="rot_deg" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="ratio" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="margin" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="residual_m" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="share" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="n_field" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="n_measured" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="n_pairs" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="n_sugg" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="radius_m" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="x" unique_strength="0"/>
    <constraint constraints="0" exp_strength="0" notnull_strength="0" field="y" unique_strength="0"/>
  </constraints>
  <constraintExpressions>
    <constraint desc="" exp="" field="plot_id"/>
    <constraint desc="" exp="" field="status"/>
    <constraint desc="" exp="" field="reason"/>
    <constraint desc="" exp="" field="offset_e_m"/>
    <constraint desc="" exp="" field="offset_n_m"/>
    <constraint desc="" exp="" field="rot_deg"/>
    <constraint desc="" exp="" field="ratio"/>
    <constraint desc="" exp="" field="margin"/>
    <constraint desc="" exp="" field="residual_m"/>
    <constraint desc="" exp="" field="share"/>
    <constraint desc="" exp="" field="n_field"/>
    <constraint desc="" exp="" field="n_measured"/>
    <constraint desc="" exp="" field="n_pairs"/>
    <constraint desc="" exp="" field="n_sugg"/>
    <constraint desc="" exp="" field="radius_m"/>
    <constraint desc="" exp="" field="x"/>
    <constraint desc="" exp="" field="y"/>
  </constraintExpressions>
  <expressionfields/>
  <attributetableconfig sortExpression="" sortOrder="0" actionWidgetStyle="dropDown">
    <columns/>
  </attributetableconfig>
  <conditionalstyles>
    <rowstyles/>
    <fieldstyles/>
  </conditionalstyles>
  <storedexpressions/>
  <editform tolerant="1"></editform>
  <editforminit/>
  <editforminitcodesource>0</editforminitcodesource>
  <editforminitfilepath></editforminitfilepath>
  <editforminitcode><![CDATA[]]></editforminitcode>
  <featformsuppress>0</featformsuppress>
  <editorlayout>generatedlayout</editorlayout>
  <editable/>
  <labelOnTop/>
  <reuseLastValue/>
  <dataDefinedFieldProperties/>
  <widgets/>
  <previewExpression>"plot_id"</previewExpression>
  <mapTip>&lt;b>Plot [% "plot_id" %]&lt;/b> ([% "status" %])&lt;br>[% "n_pairs" %] of [% "n_field" %] field trees paired&lt;br>moved [% format_number("offset_e_m", 2) %] m east, [% format_number("offset_n_m", 2) %] m north, turned [% format_number("rot_deg", 1) %]°[% coalesce('&lt;br>' || "reason", '') %]</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
